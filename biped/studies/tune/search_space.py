"""The space of a search: the numbers of a gait and of a scenario that vary, and the coordinates that CMA-ES sees.

Gains vary by ratios, angles by differences, and what is zero stays zero: a gait found is one of the same structure,
four leg states with springs and dampers at the same places.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.scenario.gains import (
    GAINS,
    KNEES,
    LACKED,
    OUT_OF_PLANE,
    PACE,
    Gains,
    Pace,
    Placement,
    number,
    single,
    with_numbers,
)
from biped.scenario.goals import Range, Tune
from biped.scenario.keys import Scenario
from biped.scenario.vary import ChangeOrigin, lookup

DEGREES = 20.0
"""Degrees per unit of an angle's coordinate; a quarter of it out of the plane."""

PLACEMENT = 0.3
"""[rad/m, rad s/m; m/s] per unit of the coordinates of foot placement and of pace."""
SLOPE = 5.0
"""[m/s per rad, rad/rad] likewise, of what thighs make of slopes."""
LEAN = 1.0
"""[rad/rad] likewise, of what the torso makes of them."""

_SPRING = {"theta_l": "k_d2", KNEES: "k_d3", "theta_a": "k_d4"}
"""Angles that mean something only where their spring has stiffness."""

_PLACEMENT = "frontal.placement"
_OPTIONAL = tuple(
    f"{table}.{name}" for table, kind in ((PACE, Pace), (_PLACEMENT, Placement)) for name in kind.may_lack()
)
"""Numbers of a gait that it may lack."""
_BY_RATIO = f"{PACE}.knee", f"{PACE}.ankle", *(f"{_PLACEMENT}.{name}" for name in ("apart", "shorten", "push"))
"""Numbers of a pace and of a placement that are never negative."""


class Axis(NamedTuple):
    """One number that varies.

    Attributes:
        name: Dotted: a gain (`k_d2.0`) or a scenario key.
        start: Its value at the origin of the search.
        log: Whether its coordinate is ln(value / start) / unit, or (value - start) / unit.
        unit: Size of one unit of the coordinate.
        low: Smallest coordinate.
        high: Largest coordinate.
        gain: Whether it is a gain.
    """

    name: str
    start: float
    log: bool
    unit: float
    low: float
    high: float
    gain: bool

    def value(self, x: float) -> float:
        """The number at a coordinate, to four significant digits: what is tested is what a file can say."""
        value = self.start * math.exp(self.unit * x) if self.log else self.start + self.unit * x
        return float(f"{value:.4g}")


class Candidate(NamedTuple):
    """The gains that a point of the search space stands for.

    Attributes:
        gains: A complete gait.
        keys: Values of other scenario keys.
    """

    gains: Gains
    keys: tuple[tuple[str, float], ...]


class SearchSpace:
    """The numbers that vary.

    Args:
        scenario: The scenario to tune.
        gains: The gait that the search starts at, complete.

    Raises:
        InputError: A name in [tune] stands for nothing that can vary.
    """

    def __init__(self, scenario: Scenario, gains: Gains):
        assert scenario.tune is not None
        self.gains = gains
        self.axes = _gain_axes(scenario.tune, gains)
        self.axes += [key_axis(scenario, "tune.keys", key, span) for key, span in scenario.tune.keys.items()]
        if not self.axes:
            raise InputError("tune.gains: expected at least one gain or key that can vary; zero gains stay zero")

    @property
    def bounds(self) -> tuple[list[float], list[float]]:
        """Lowest and highest coordinates."""
        return [axis.low for axis in self.axes], [axis.high for axis in self.axes]

    def candidate(self, x: Sequence[float] | np.ndarray) -> Candidate:
        """The gait and keys at coordinates x, which are brought within bounds."""
        numbers, keys = {}, []
        for axis, coordinate in zip(self.axes, x, strict=True):
            value = axis.value(min(max(float(coordinate), axis.low), axis.high))
            if axis.gain:
                numbers[axis.name] = value
            else:
                keys.append((axis.name, value))
        return Candidate(with_numbers(self.gains, numbers), tuple(keys))


def names_of(gains: Gains) -> list[str]:
    """Names of the gains that a complete gait has; of what it may lack, and of tables out of the plane, what it has."""
    return [*GAINS, *(table for table in (*LACKED, *OUT_OF_PLANE) if getattr(gains, table) is not None)]


def varied(tune: Tune, gains: Gains) -> list[str]:
    """Names of the single numbers of a complete gait that a search may vary.

    Raises:
        InputError: The gait has no gain of a name in [tune].
    """
    known, found = names_of(gains), []
    for name in known if tune.gains is None else tune.gains:
        numbers = single([name]) if name.partition(".")[0] in known else []
        if not numbers or any(each not in single(known) for each in numbers):
            raise InputError(f"tune.gains: no gain '{name}'; {nearest(name.partition('.')[0], known)}")
        found += numbers
    return found


def _gain_axes(tune: Tune, gains: Gains) -> list[Axis]:
    names = [name for name in varied(tune, gains) if _means_something(gains, name)]
    axes = [_gain_axis(tune, name, number(gains, name)) for name in names]
    return [axis for axis in axes if not axis.log or axis.start > 0.0]


def _means_something(gains: Gains, name: str) -> bool:
    """Whether a single number is more than the rest angle of a spring without stiffness, or the heading asked for.

    Or what a walker in the plane makes of slopes to the side, or parts of a pace or of a placement that it lacks.
    """
    way, _, state = name.rpartition(".")
    table, _, whole = way.rpartition(".")
    if name == "axial.theta_b" or (name == f"{PACE}.side" and gains.frontal is None):
        return False
    if name in _OPTIONAL:
        return number(gains, name) is not None
    spring = _SPRING.get(whole)
    if spring is None or not state.isdigit():
        return True
    return number(gains, f"{f'{table}.' if table else ''}{spring}.{state}") > 0.0


def _gain_axis(tune: Tune, name: str, value: float) -> Axis:
    if "theta" in name:
        unit = DEGREES if name.startswith("theta") else 0.25 * DEGREES
        most = tune.angle / DEGREES
        return Axis(name, value, False, unit, -most, most, True)
    if name in (f"{PACE}.slope", f"{PACE}.side"):
        return Axis(name, value, False, SLOPE, -1.0, 1.0, True)
    if name == f"{PACE}.lean":
        return Axis(name, value, False, LEAN, -1.0, 1.0, True)
    if name.startswith((f"{_PLACEMENT}.", f"{PACE}.")) and name not in _BY_RATIO:
        return Axis(name, value, False, PLACEMENT, -tune.angle / DEGREES, tune.angle / DEGREES, True)
    most = math.log(tune.factor)
    return Axis(name, value, True, 1.0, -most, most, True)


def key_axis(scenario: Scenario, table: str, key: str, span: Range) -> Axis:
    """The axis of a scenario's key that varies.

    Args:
        scenario: The one to tune.
        table: Dotted key of the table that names it, for errors.
        key: The key that varies.
        span: Between which values.

    Raises:
        InputError: There is no such key, it is no number, or the span is none around its value.
    """
    value = lookup(scenario, key, ChangeOrigin(table))
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f'{table}."{key}": expected a key that is one number, it is {value!r}')
    own = "the scenario's own"
    if span.start is not None and not span.min <= value <= span.max:
        own, value = "start =", span.start
    if not span.min <= value <= span.max or span.min == span.max:
        raise InputError(f'{table}."{key}": expected min < max around {own} {value}, got {span.min} … {span.max}')
    if span.scale == "linear":
        unit = span.max - span.min
        return Axis(key, value, False, unit, (span.min - value) / unit, (span.max - value) / unit, False)
    if span.min <= 0.0:
        raise InputError(f'{table}."{key}".min: expected more than zero on a log scale, got {span.min}')
    return Axis(key, value, True, 1.0, math.log(span.min / value), math.log(span.max / value), False)
