"""Families of gaits: one file, one parameter. Between the speeds that a file knows, gains are interpolated.

A gait file may end in `[[speeds]]` tables, each with the speed `at` which its gains hold; the scenario key
`gains.speed` asks for one. Without that key the file is the gait it would be without the tables.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

from biped.base.errors import InputError
from biped.scenario.gains import GAINS, Gains
from biped.scenario.section import Positive

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
