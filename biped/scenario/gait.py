"""A gait file: gains, perhaps a family of them, and the settings that they were made for."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import label, layered, locate
from biped.scenario.gains import GAINS, NOT_NEEDED, OUT_OF_PLANE, Gains
from biped.scenario.origin import Origin
from biped.scenario.section import Positive
from biped.scenario.settings import GAIT, Settings, typed
from biped.scenario.valid import convert, known_keys


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Any], Any, Origin]:
    """Gains, settings and family of a gait file, as written."""
    data, keys = layered(path, "controllers")
    for word in ("description", "source"):
        data.pop(word, None)
    settings = {name: data.pop(name) for name in GAIT if name in data}
    return data, settings, data.pop("speeds", ()), Origin(path, keys)


def read_gains(path: Path, override: Gains) -> Gains:
    """Reads a controller file (and what it extends) and lays a scenario's own gains over it.

    Raises:
        InputError: A gain is missing, unknown or of the wrong type.
    """
    data, _, speeds, origin = _read(path)
    known_keys(data, Gains, "", origin.fault)
    gains = convert(data, Gains, origin.fault)
    if override.speed is not None:
        from biped.scenario.gait import Knot, gains_at

        knots = convert(speeds, tuple[Knot, ...], lambda key, what: origin.fault(f"speeds{key}", what))
        gains = replace(gains, **gains_at(knots, override.speed, origin.fault))
    gains = gains.replaced(override)
    missing = [name for name in gains.missing() if name not in ("speed", *NOT_NEEDED, *OUT_OF_PLANE)]
    if missing:
        table = missing[0].partition(".")[0] if "." in missing[0] else ""
        names = getattr(gains, table).__struct_fields__ if table else GAINS
        whole = f"[{table}]" if table else "a gait"
        raise InputError(f"{label(path)}: {missing[0]}: missing; {whole} has {', '.join(names)}")
    return gains


class Gaits(dict[tuple[str, Gains], Gains]):
    """Complete gains by the name of a gait and what a scenario lays over it; files are read once.

    Raises:
        InputError: Where one is asked for: there is no such gait, or a gain is missing, unknown or of the wrong type.
    """

    def __missing__(self, key: tuple[str, Gains]) -> Gains:
        controller, own = key
        self[key] = read_gains(locate("controllers", controller, "controller"), own)
        return self[key]


def speeds_of(path: Path) -> tuple[float, float] | None:
    """Smallest and largest speed [m/s] of a gait file's family, `[[speeds]]`; None if it has none."""
    _, _, speeds, origin = _read(path)
    if not speeds:
        return None
    from biped.scenario.gait import Knot

    knots = convert(speeds, tuple[Knot, ...], lambda key, what: origin.fault(f"speeds{key}", what))
    return min(knot.at for knot in knots), max(knot.at for knot in knots)


def in_the_plane(gains: Gains, model: str, at: str = "") -> None:
    """Makes sure that a gait is one of a biped that moves in the plane.

    Args:
        gains: The gait.
        model: Whose.
        at: What its key begins with: `change[0].` of one that a change goes over to.

    Raises:
        InputError: It has tables of one that moves in space.
    """
    for table in OUT_OF_PLANE:
        if getattr(gains, table) is not None:
            raise InputError(f"{at}gains.{table}: expected none: model '{model}' moves in the plane; [{table}] is of "
                             "bipeds that move in space", f"{at}gains.{table}")  # fmt: skip
    for name in NOT_NEEDED:
        if getattr(gains, name) is not None:
            raise InputError(
                f"{at}gains.{name}: expected none: model '{model}' moves in the plane", f"{at}gains.{name}"
            )


def out_of_the_plane(gains: Gains, model: str, at: str = "") -> None:
    """Makes sure that a gait is one of a biped that moves in space; arguments as of `in_the_plane`.

    Raises:
        InputError: A table is missing.
    """
    for table in OUT_OF_PLANE:
        if getattr(gains, table) is None:
            raise InputError(f"{at}gains.{table}: missing: model '{model}' moves in space, which asks for "
                             f"{' and '.join(f'[{name}]' for name in OUT_OF_PLANE)} in its gait file "
                             "(controllers/human3d.toml has them)", f"{at}gains.{table}")  # fmt: skip


def read_settings(path: Path) -> tuple[Settings, Origin]:
    """Reads the settings that a gait was made for, and where each was written.

    Raises:
        InputError: A setting is unknown, of the wrong type or impossible.
    """
    _, tables, _, origin = _read(path)
    return typed(tables, GAIT, origin), origin


Fail = Callable[[str, str], InputError]


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
    names = [name for name in GAINS if any(getattr(knot, name) is not None for knot in knots)]
    for knot in knots:
        for name in names:
            if getattr(knot, name) is None:
                raise fail("speeds", f"expected {name} at {knot.at:g} m/s too, as at other speeds")
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
    return a + share * (b - a)
