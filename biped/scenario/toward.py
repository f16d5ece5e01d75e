"""A gait part of the way to another one, `[toward]` of a gait file: every number that both have lies between theirs."""

from typing import Annotated, Any, TypeGuard

from msgspec import Meta

from biped.base.errors import echo
from biped.base.typed import Name, Section
from biped.scenario.valid import Fail


class Toward(Section, frozen=True):
    """The gait to which a gait file's numbers move, after all else that it says, and how far.

    Attributes:
        gait: Name or path.
        share: Of the way, 0 to 1.
    """

    gait: Name
    share: Annotated[float, Meta(ge=0, le=1)]


def between(mine: Any, theirs: Any, share: float, key: str, fail: Fail) -> Any:
    """Plain data with each number that both have moved by a share of the way; what only one has stays as it is here.

    Args:
        mine: Of the gait that moves.
        theirs: Of the gait to which it does.
        share: Of the way.
        key: Dotted key of both.
        fail: Makes the error.

    Raises:
        InputError: The two differ in something other than numbers.
    """
    if isinstance(mine, dict) and isinstance(theirs, dict):
        at = f"{key}." if key else ""
        return {
            name: between(mine[name], theirs[name], share, at + name, fail) if name in theirs else mine[name]
            for name in mine
        }
    if isinstance(mine, list) and isinstance(theirs, list) and len(mine) == len(theirs):
        return [between(a, b, share, f"{key}.{i}", fail) for i, (a, b) in enumerate(zip(mine, theirs, strict=True))]
    if mine == theirs:
        return mine
    if _number(mine) and _number(theirs):
        return mine + share * (theirs - mine)
    raise fail(key, f"expected the same in both gaits of [toward], got {echo(mine)} and {echo(theirs)}")


def _number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)
