"""Signals of a run that rise before it falls: what splitting takes its levels from.

A score is a signal, or several, in every row that is looked at. Where it is highest says how close a run came to a
fall; when it first reached a level is where another run may branch off.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from biped.measure.metrics.space import extrapolated, foot_places, headings
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY

EVERY = 0.01
"""[s] between the rows that are looked at."""
HORIZON = 6.0
"""[√(l/g)] ahead of a state within which a fall counts, with l the length of a leg: about 1.9 s, two to three steps."""
NEVER = 9.0
"""[horizons] until a fall that was not seen."""
LEFT = 18
"""Column of a state that says how much time is left."""
LEAST_LEFT = 0.05
"""[horizons] of time left below which less makes no difference."""
LATEST = 5.0
"""[√(l/g)] since the last strike after which a step is simply late."""
FARTHEST = 6.0
"""[standard deviations] beyond which numbers of a state count as no farther."""
LEARNED = "learned"
"""The score that a command learns for itself."""


class LearnedScore(NamedTuple):
    """Log odds of a fall soon, quadratic in the state of a walk.

    Attributes:
        mean: (k,) of every number of the state.
        deviation: (k,) likewise; infinite where it never changes.
        weights: Of 1, of the standardised numbers and of their products.
    """

    mean: tuple[float, ...]
    deviation: tuple[float, ...]
    weights: tuple[float, ...]

    def __call__(self, states: np.ndarray) -> np.ndarray:
        """(n,) log odds of states (n, k)."""
        return design(states, self.mean, self.deviation) @ np.array(self.weights)


Score = str | LearnedScore
"""A score by its name, or one that was learned."""


def design(states: np.ndarray, mean: Any, deviation: Any) -> np.ndarray:
    """(n, 1 + k + k (k + 1) / 2) of states (n, k): 1, themselves standardised, and their products."""
    z = np.clip((states - np.asarray(mean)) / np.asarray(deviation), -FARTHEST, FARTHEST)
    first, second = np.triu_indices(z.shape[1])
    return np.concatenate([np.ones((len(z), 1)), z, z[:, first] * z[:, second]], axis=1)


def margins(t: Trajectory) -> np.ndarray:
    """(n, 4) how far the extrapolated centre of mass is beyond the feet that stand, in leg lengths.

    Columns: forward, back, to the left and to the right of where the base faces; in the plane the last two are zero. A
    walk is beyond in every step (the other foot catches it): what counts is how far above the usual.
    """
    standing = t.down[:, t.robot.of_foot].astype(bool)
    centre, place = extrapolated(t), t.point[:, :, :2]
    angle, out = headings(t), []
    forward, left = (np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))
    for way in (np.stack(forward, axis=1), np.stack(left, axis=1)):
        at, reach = (centre * way).sum(axis=1), (place * way[:, None]).sum(axis=2)
        out += [at - np.where(standing, reach, -np.inf).max(axis=1), np.where(standing, reach, np.inf).min(axis=1) - at]
    beyond = np.stack(out, axis=1)
    beyond[~standing.any(axis=1)] = np.nan
    return beyond / t.robot.leg


def leans(t: Trajectory) -> np.ndarray:
    """(n, 2) [rad] lean of the base forward and back: it does not grade, and stands here to be compared with."""
    return np.stack([t.lean, -t.lean], axis=1)


def drops(t: Trajectory) -> np.ndarray:
    """(n, 1) how far the centre of mass is below where it began, in leg lengths."""
    return (t.com[0, 2] - t.com[:, 2:]) / t.robot.leg


SCORES: dict[str, Callable[[Trajectory], np.ndarray]] = {"margin": margins, "drop": drops, "lean": leans}
"""Precursors by the name of the score that is made of them."""


def time_left(time: np.ndarray) -> np.ndarray:
    """(n,) logarithm of the time [horizons] that is left, of as much as makes a difference."""
    return np.log(np.clip(time, LEAST_LEFT, 1.0))


def horizon_of(t: Trajectory) -> float:
    """[s] ahead of a state within which a fall counts."""
    return HORIZON * math.sqrt(t.robot.leg / GRAVITY)


def states_of(t: Trajectory, duration: float) -> np.ndarray:
    """(n, 22) the state of a walk every 10 ms, in leg lengths, √(l/g), weights and rad.

    The foot that struck last stands, the next one swings; where the first foot swings, left and right change places.
    Columns: extrapolated centre of mass forward and to the side of either foot, centre of mass of the standing foot
    (6); its height above the ground and its vertical velocity; lean forward and to the side, and their rates (4);
    height of the lowest point of either foot, and whether it is on the ground (4); time since the last strike; how far
    the other foot is ahead of the standing one; time left of the run, at most the horizon (`time_left`); sum of the
    pushes forward, to the side and up (3).

    Args:
        t: The run.
        duration: [s] that it would take.
    """
    rows = np.arange(0, len(t), max(1, round(EVERY / t.tick)))
    leg, unit = t.robot.leg, math.sqrt(t.robot.leg / GRAVITY)
    strikes = np.array(t.strikes, dtype=int).reshape(-1, 2)
    number = np.searchsorted(strikes[:, 0], rows, side="right")
    stands = np.concatenate([[0], strikes[:, 1]])[number]
    swings, pick = 1 - stands, np.arange(len(rows))
    angle = headings(t)[rows]
    forward, left = np.stack([np.cos(angle), np.sin(angle)], axis=1), np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    mirror = np.where(stands == 0, 1.0, -1.0)

    def away(place: np.ndarray, of: np.ndarray) -> list[np.ndarray]:
        gap = (place - of) / leg
        return [(gap * forward).sum(axis=1), mirror * (gap * left).sum(axis=1)]

    place = foot_places(t)[rows][:, :, :2]
    standing, swinging = place[pick, stands], place[pick, swings]
    centre, capture = t.com[rows], extrapolated(t)[rows]
    axis = t.turn[rows] @ np.array(t.robot.upright)
    lean, roll = t.lean[rows], mirror * (axis[:, :2] * left).sum(axis=1)
    low = np.stack([t.above[rows][:, t.robot.of_foot == foot].min(axis=1) for foot in (0, 1)], axis=1) / leg
    down = t.down[rows].astype(float)
    step = np.diff(rows, prepend=rows[0] - 1) * t.tick / unit
    since = (rows - np.concatenate([[0], strikes[:, 0]])[number]) * t.tick / unit
    remaining = time_left((duration - t.time[rows]) / horizon_of(t))
    push = _pushes(t, rows) / (t.mass * GRAVITY)
    return np.stack(
        [
            *away(capture, standing), *away(capture, swinging), *away(centre[:, :2], standing),
            (centre[:, 2] - t.ground.height(centre[:, 0])) / leg, t.com_velocity[rows, 2] / leg * unit,
            lean, roll, np.diff(lean, prepend=lean[0]) / step, np.diff(roll, prepend=roll[0]) / step,
            low[pick, stands], low[pick, swings], down[pick, stands], down[pick, swings],
            np.minimum(since, LATEST), away(swinging, standing)[0], remaining,
            (push[:, :2] * forward).sum(axis=1), mirror * (push[:, :2] * left).sum(axis=1), push[:, 2],
        ],
        axis=1,
    )  # fmt: skip


def _pushes(t: Trajectory, rows: np.ndarray) -> np.ndarray:
    """(n, 3) [N] sum of the pushes that act at rows."""
    changes = np.zeros((len(rows) + 1, 3))
    for start, end, *force, _ in t.pushes:
        first, last = np.searchsorted(t.time[rows], (start - 1e-9, end - 1e-9))
        given = np.array([force[0], 0.0, force[1]] if len(force) == 2 else force)
        changes[first] += given
        changes[last] -= given
    return changes.cumsum(axis=0)[:-1]
