"""The record of a run: whether it fell, how, and how its score rose."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from biped.measure.metrics.space import headings
from biped.measure.trajectory import Trajectory
from biped.studies.certify.scores import EVERY, NEVER, SCORES, Score, horizon_of, states_of

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
    speed = t.com_velocity[-1, :2] @ np.stack([(c := np.cos(headings(t)[-1]), s := np.sin(headings(t)[-1])), (-s, c)]).T
    names = ("forward", "back") if abs(speed[0]) >= abs(speed[1]) else ("to the left", "to the right")
    whither = names[int(speed[int(abs(speed[0]) < abs(speed[1]))] < 0.0)]
    if len(t.strikes) < 3:
        return f"{whither}, before the third step"
    rows = [row for row, _ in t.strikes]
    step, since = float(np.median(np.diff(rows))), len(t) - rows[-1]
    when = "within a step" if since <= step else "within two steps" if since <= 2.0 * step else "later"
    return f"{whither}, {when} of a strike of foot {t.strikes[-1][1]}"
