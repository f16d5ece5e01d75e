"""A family of gaits over speed, `[[speeds]]` of a gait file: gains that hold at some speeds, and those between."""

from itertools import pairwise
from typing import Any

from biped.base.typed import Positive
from biped.scenario.gains import GAINS, LACKED, Gains, PartialGains
from biped.scenario.valid import Fail


class Knot(Gains, frozen=True, kw_only=True):
    """Gains that hold at one speed.

    Attributes:
        at: [m/s].
    """

    at: Positive


def gains_at(knots: tuple[Knot, ...], speed: float, fail: Fail) -> dict[str, Any]:
    """The family's gains at a speed, linear between its knots.

    Args:
        knots: What the gait file knows.
        speed: [m/s] asked for.
        fail: Makes the error of a key of the gait file.

    Returns:
        Gains by name, only those that the family changes.
    """
    if len(knots) < 2:
        raise fail("speeds", f"expected at least two tables [[speeds]] to find a gait for gains.speed = {speed:g}")
    knots = tuple(sorted(knots, key=lambda knot: knot.at))
    names = [name for name in (*GAINS, *LACKED) if any(getattr(knot, name) is not None for knot in knots)]
    for knot in knots:
        for name in names:
            value = getattr(knot, name)
            if value is None or (isinstance(value, PartialGains) and value.missing()):
                raise fail("speeds", f"expected {name} at {knot.at:g} m/s too, all of it, as at other speeds")
    for below, above in pairwise(knots):
        if below.at == above.at:
            raise fail("speeds", f"expected different speeds, got {below.at:g} m/s twice")
    if not knots[0].at <= speed <= knots[-1].at:
        raise fail("speeds", f"expected gains.speed within {knots[0].at:g} … {knots[-1].at:g} m/s, got {speed:g}")
    below, above = next((a, b) for a, b in pairwise(knots) if speed <= b.at)
    share = (speed - below.at) / (above.at - below.at)
    return {name: _between(getattr(below, name), getattr(above, name), share) for name in names}


def _between(a: Any, b: Any, share: float) -> Any:
    if isinstance(a, tuple):
        return tuple(_between(x, y, share) for x, y in zip(a, b, strict=True))
    if isinstance(a, PartialGains):
        return type(a)(**{name: _between(getattr(a, name), getattr(b, name), share) for name in a.__struct_fields__})
    if a is None and b is None:  # a part that both may lack
        return None
    return (a or 0.0) + share * ((b or 0.0) - (a or 0.0))
