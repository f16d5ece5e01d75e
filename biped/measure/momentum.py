"""Whether a robot's momentum is explained by what may act on it: gravity, the ground, and the pushes of the scenario.

Inside a robot forces come in pairs, so whatever its law, its joints' stops, springs and loops do, the momentum of the
whole changes by what acts from outside alone: along three directions, and about the centre of mass. What is left over
is a force or a moment of something else, and no list of what that could be is needed.

A step of the physics changes momentum by the impulses of that step; the motion of the links during the step changes
it once more, by the step times the change of the forces m r ω² that turning takes. What is left is judged as a mean
over a window, in which that comes and goes: over a fifth of a second, and over two seconds for what stays. What is
left of it at the two ends of a window, each no more than twice the energy of the links' motion over the length of a
leg, is taken off.

Nor may the centre of mass move by anything but its velocity: who sets places instead of forces leaves momentum alone.
"""

import math
from typing import NamedTuple

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY

SHORT, LONG = 0.2, 2.0
"""[s] of the windows."""
FALLING = 0.05
"""[s] before the end of a run that fell which is left out: links that crash into the ends of their joints turn so fast
that a step of the physics no longer changes momentum by the impulses of that step alone."""
TURNING = 3
"""Number of the first axis that is turned about."""
_FREE = {3: (0, 2, 4), 6: (0, 1, 2, 3, 4, 5)}
"""Columns of momentum and angular momentum that a base of so many coordinates, in the plane or in space, changes."""
_WAYS = ("forward", "to the left", "up", "about the axis forward", "about the axis to the left", "about the axis up")
_AGAINST = ("backward", "to the right", "down", *(f"{way}, backward" for way in _WAYS[3:]))


class Mean(NamedTuple):
    """The largest mean of what nothing explains, over any window of a length.

    Attributes:
        share: Of the weight, of the weight at the length of a leg, or of the speed √(g l) of a leg's length l, beyond
            what steps of the physics leave.
        size: [N], [N m] or [m/s].
        when: [s] the middle of that window.
        way: Its direction in words.
    """

    share: float
    size: float
    when: float
    way: str


class Unexplained(NamedTuple):
    """Force, moment and speed that nothing explains of a run.

    Attributes:
        force: The largest force over any window of `SHORT` and of `LONG`; nothing where the run is too short.
        moment: The largest moment about the centre of mass, likewise.
        speed: The largest speed at which the centre of mass changes its place beyond its velocity, likewise.
    """

    force: tuple[Mean, Mean]
    moment: tuple[Mean, Mean]
    speed: tuple[Mean, Mean]


_NOTHING = Mean(0.0, 0.0, 0.0, "")


def unexplained(t: Trajectory) -> Unexplained:
    """Returns force, moment and speed that nothing explains; nothing of a run whose angular momentum was not kept."""
    rows = len(t) - (round(FALLING / t.tick) if t.end == "fell" else 0)
    if t.spin is None or t.wrench is None or rows < 2:
        return Unexplained((_NOTHING, _NOTHING), (_NOTHING, _NOTHING), (_NOTHING, _NOTHING))
    weight = t.mass * GRAVITY
    free = _FREE[len(t.robot.base_columns)]
    force, moment = ([column for column in free if (column < TURNING) == along] for along in (True, False))
    left = {column: leftover(t, column)[:rows] for column in free}
    moved = {column: leap(t, column)[:rows] for column in force}
    turning = 4.0 * _moving(t, rows) / t.robot.leg
    return Unexplained(
        _largest(t, left, force, (weight, turning)),
        _largest(t, left, moment, (weight * t.robot.leg, turning * t.robot.leg)),
        _largest(t, moved, force, (math.sqrt(GRAVITY * t.robot.leg), 0.0)),
    )


def _moving(t: Trajectory, rows: int) -> float:
    """[J] most energy of the links' motion about the centre of mass in the first rows."""
    along = np.einsum("ij,ij->i", t.com_velocity, t.com_velocity)
    about = t.energy + t.mass * (t.com @ np.array(t.gravity) - 0.5 * along)
    return max(0.0, float(about[:rows].max()))


def leftover(t: Trajectory, column: int) -> np.ndarray:
    """Returns the impulse that nothing explains up to each row.

    Args:
        t: A run whose angular momentum was kept.
        column: Along the ground, to the left, normal; about these axes at the centre of mass.

    Returns:
        (n,) [N s] or [N m s].
    """
    assert t.spin is not None
    assert t.wrench is not None
    acting = t.wrench[:-1, column]
    if column < TURNING:
        changed = t.mass * t.com_velocity[:, column]
        acting = acting + t.mass * t.gravity[column]
    else:
        changed = t.spin[:, column - TURNING]
    out = changed - changed[0]
    out[1:] -= t.tick * np.cumsum(acting)
    return out


def leap(t: Trajectory, column: int) -> np.ndarray:
    """Returns how far the centre of mass is from where its velocity took it: (n,) [m] up to each row.

    Args:
        t: The run.
        column: Along the ground, to the left, normal.
    """
    out = t.com[:, column] - t.com[0, column]
    out[1:] -= t.tick * np.cumsum(t.com_velocity[1:, column])
    return out


def _largest(
    t: Trajectory, left: dict[int, np.ndarray], columns: list[int], units: tuple[float, float]
) -> tuple[Mean, Mean]:
    short, long = (
        max((_mean(t, left[column], column, units, seconds) for column in columns), key=_size)
        for seconds in (SHORT, LONG)
    )
    return short, long


def _size(mean: Mean) -> float:
    return np.inf if np.isnan(mean.share) else mean.share


def _mean(t: Trajectory, left: np.ndarray, column: int, units: tuple[float, float], seconds: float) -> Mean:
    """The largest mean along or about one axis; of a run that is shorter, and longer than half of it, of the run.

    Units are that of a share, and what turning takes.
    """
    rows = min(round(seconds / t.tick), len(left) - 1)
    if rows < 0.5 * seconds / t.tick:
        return _NOTHING
    mean = left[rows:] - left[:-rows]
    row = int(np.argmax(np.abs(mean)))  # a number that is none is the largest
    size = float(mean[row]) / (rows * t.tick)
    way = (_WAYS if size > 0.0 else _AGAINST)[column]
    beyond = abs(size) - t.tick * units[1] / seconds
    share = beyond / units[0] if not beyond <= 0.0 else 0.0  # nan stays
    return Mean(share, abs(size), float(t.time[row]) + 0.5 * rows * t.tick, way)
