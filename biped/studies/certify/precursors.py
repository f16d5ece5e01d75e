"""Signals of a run that rise before it falls: what splitting takes its levels from.

A precursor is a signal in every row of a trajectory, in natural units. Where it is highest says how close a run came to
a fall; when it first reached a level is where another run may branch off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from biped.measure.metrics.space import extrapolated, headings
from biped.measure.trajectory import Trajectory

EVERY = 0.01
"""[s] between the rows that are looked at."""


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
    """

    fell: bool
    end: float
    rises: tuple[tuple[float, int, float], ...]
    steps: int = 0
    other: str = ""
    way: str = ""
    squares: float = 0.0
    stands: bool = True

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


def outcome_of(t: Trajectory, score: str) -> RunOutcome:
    """The outcome of a run by a score."""
    every = max(1, round(EVERY / t.tick))
    with np.errstate(all="ignore"):
        signals = np.nan_to_num(SCORES[score](t)[::every], nan=-np.inf)
    times, rises = t.time[::every], []
    for number, signal in enumerate(signals.T):
        highest = np.maximum.accumulate(signal)
        rows = np.flatnonzero(highest > np.append(-np.inf, highest[:-1]))
        rises += [(round(float(times[row]), 9), number, round(float(signal[row]), 6)) for row in rows]
    other = "" if t.end in ("fell", "completed") else t.end
    end = round(float(t.time[-1]), 9)
    return RunOutcome(t.end == "fell", end, tuple(sorted(rises)), len(t.strikes), other, way_of(t))


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
