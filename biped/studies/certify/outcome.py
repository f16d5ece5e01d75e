"""The outcome of a run: whether it fell, how, and the signals that rose before: what splitting takes its levels from.

A score is a signal, or several, in every row that is looked at. Where it is highest says how close a run came to a
fall; when it first reached a level is where another run may branch off.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from biped.measure.metrics.gait import extrapolated, foot_places
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY

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
    angle, out = t.heading, []
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
    angle = t.heading[rows]
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
    for push in declared(t):
        first, last = np.searchsorted(t.time[rows], (push.start - 1e-9, push.end - 1e-9))
        changes[first] += push.force
        changes[last] -= push.force
    return changes.cumsum(axis=0)[:-1]


LEARNT_EVERY = 5
"""Of the rows that are looked at, those that a score is learned from: every 50 ms."""


class RunOutcome(NamedTuple):
    """How close a run came to a fall.

    Attributes:
        fell: Whether it fell.
        end: [s] when it ended.
        rises: (time [s], number of the precursor, value) wherever a precursor rose above all that it was before.
        steps: Foot strikes.
        other: How it ended if it neither fell nor was completed; else empty.
        way: How it fell: whither, on which foot, and when after its last strike; else empty.
        squares: Sum of the squares of the normals that it drew.
        stands: Whether another law stood what this one met; of a comparison.
        states: States of the walk, and how long it takes until the fall: what a score is learned from.
    """

    fell: bool
    end: float
    rises: tuple[tuple[float, int, float], ...]
    steps: int = 0
    other: str = ""
    way: str = ""
    squares: float = 0.0
    stands: bool = True
    states: tuple[tuple[float, ...], ...] = ()

    def peak(self, number: int) -> float:
        """The largest value of a precursor; minus infinity where it has none."""
        return max((value for _, which, value in self.rises if which == number), default=-np.inf)

    def score(self, baseline: Sequence[float]) -> float:
        """The largest that any precursor came above its baseline; infinite of a fall."""
        if self.fell:
            return np.inf
        return max((value - baseline[which] for _, which, value in self.rises), default=-np.inf)

    def reached(self, level: float, baseline: Sequence[float]) -> float:
        """[s] when the score first reached a level; at its end if only by the fall."""
        times = (time for time, which, value in self.rises if value - baseline[which] >= level)
        return min(times, default=self.end)


def outcome_of(t: Trajectory, score: Score | None, duration: float, since: float = math.inf) -> RunOutcome:
    """The outcome of a run.

    Args:
        t: The run.
        score: What rises; None: nothing does.
        duration: [s] that it would take.
        since: [s] from which states are recorded, from which a score is learned; default: never.
    """
    other = "" if t.end in ("fell", "completed") else t.end
    end = round(float(t.time[-1]), 9)
    with np.errstate(all="ignore"):
        states = _labelled(t, duration, since) if since < math.inf else ()
        out = RunOutcome(t.end == "fell", end, (), len(t.strikes), other, way_of(t), states=states)
        if score is None:
            return out
        if isinstance(score, str):
            signals = SCORES[score](t)[:: max(1, round(EVERY / t.tick))]
        else:
            signals = score(states_of(t, duration))[:, None]
    signals = np.nan_to_num(signals, nan=-np.inf)
    times, rises = t.time[:: max(1, round(EVERY / t.tick))], []
    for number, signal in enumerate(signals.T):
        highest = np.maximum.accumulate(signal)
        rows = np.flatnonzero(highest > np.append(-np.inf, highest[:-1]))
        rises += [(round(float(times[row]), 9), number, round(float(signal[row]), 6)) for row in rows]
    return out._replace(rises=tuple(sorted(rises)))


def _labelled(t: Trajectory, duration: float, since: float) -> tuple[tuple[float, ...], ...]:
    """States of a walk, and of each how long it takes until the fall [horizons]."""
    states = states_of(t, duration)[::LEARNT_EVERY]
    times = np.arange(len(states)) * LEARNT_EVERY * max(1, round(EVERY / t.tick)) * t.tick
    until = np.minimum((t.time[-1] - times) / horizon_of(t), NEVER) if t.end == "fell" else np.full(len(times), NEVER)
    sound = np.isfinite(states).all(axis=1) & (times >= since)
    return tuple(tuple(float(f"{number:.4g}") for number in row) for row in np.column_stack([states, until])[sound])


def way_of(t: Trajectory) -> str:
    """How a run fell, in words that runs which fell alike have in common; empty of one that did not fall."""
    if t.end != "fell":
        return ""
    speed = t.com_velocity[-1, :2] @ np.stack([(c := np.cos(t.heading[-1]), s := np.sin(t.heading[-1])), (-s, c)]).T
    names = ("forward", "back") if abs(speed[0]) >= abs(speed[1]) else ("to the left", "to the right")
    whither = names[int(speed[int(abs(speed[0]) < abs(speed[1]))] < 0.0)]
    if len(t.strikes) < 3:
        return f"{whither}, before the third step"
    rows = [row for row, _ in t.strikes]
    step, since = float(np.median(np.diff(rows))), len(t) - rows[-1]
    when = "within a step" if since <= step else "within two steps" if since <= 2.0 * step else "later"
    return f"{whither}, {when} of a strike of foot {t.strikes[-1][1]}"
