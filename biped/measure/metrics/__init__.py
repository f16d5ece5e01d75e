"""Pure functions of a trajectory: what a run's numbers are, over the scenario's window.

`assess` judges a run and gives every number of `biped.scenario.metrics.METRICS`; `Totals` those of an ensemble from its
runs in pieces: however many there are, they take no more memory than a piece.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from biped.measure import verdict
from biped.measure.metrics import belief, energy, gait, pushed
from biped.measure.metrics.walking import outcome_of, spread, stopped
from biped.measure.momentum import Unexplained, unexplained
from biped.measure.trajectory import Trajectory
from biped.scenario.metrics import METRICS


class Assessed(NamedTuple):
    """A run and its numbers.

    Attributes:
        trajectory: The run without the rows from where it blew up; it ends as `diverged` there.
        numbers: Every metric by name, `verdict` and `doubt`; see `measure`.
    """

    trajectory: Trajectory
    numbers: dict[str, Any]


def assess(t: Trajectory, window: tuple[float, float]) -> Assessed:
    """Judges a run (`biped.measure.verdict`) and measures it; arguments as of `measure`."""
    if t.end == "diverged":
        # Rows from where a number stopped being finite say nothing; the last was not written.
        sound = t.sound & (np.diff(t.time, prepend=-1.0) > 0.0)
        t = t.rows(slice(max(1, int(sound.cumprod().sum()))))
        if not sound[0]:  # the start alone is left: what was not finite in it is not known
            log = np.where(np.isfinite(t.log), t.log, 0.0)
            log[:, t.width :] = t.log[:, t.width :]
            t = replace(t, log=log)
    with np.errstate(all="ignore"):  # numbers of a run that blows up; what comes of them is judged
        fast = verdict.first_too_fast(t)
        if fast is not None:
            said = verdict.too_fast(t, fast)
            cause = f"{said}; {t.cause}" if t.cause else said
            t = t.rows(slice(max(1, fast)), end="diverged", cause=cause)
        left = unexplained(t)
        numbers = _numbers(t, window, left)
        judged = verdict.verdict_on(t, numbers, left)
    outcome = outcome_of(t, numbers, judged.verdict, window[1] - window[0])
    return Assessed(t, numbers | outcome | stopped(t, outcome) | judged._asdict())


def measure(t: Trajectory, window: tuple[float, float]) -> dict[str, Any]:
    """Every metric of one run.

    Args:
        t: The run.
        window: [s] start and end of the interval that means are taken over; a run that ended before it has nan there.

    Returns:
        Name to number, and the `verdict` with its `doubt` (`biped.measure.verdict.Verdict`). `falls`, `diverged`,
        `doubtful`, `walked`, `stood` and `sat` are 0 or 1. `per_joint` holds peak and mean torque of hip, knee and
        ankle, `leg_states` the commonest cycle of leg states and its share of all cycles, `signals` mean, smallest and
        largest of what a law of the user's own logged.
    """
    return assess(t, window).numbers


def _numbers(t: Trajectory, window: tuple[float, float], left: Unexplained) -> dict[str, Any]:
    """All but the outcome."""
    out: dict[str, Any] = dict.fromkeys(METRICS, math.nan)
    out["time"] = len(t) * t.tick if t.end == "completed" else float(t.time[-1])
    out["distance"] = float(t.x[-1] - t.x[0])
    out["energy_residual"] = energy.residual(t)
    out["energy_from_nowhere"] = energy.from_nowhere(t)
    out["momentum_residual"] = energy.momentum_residual(t)
    out["unexplained_force"], out["unexplained_moment"] = left.force[0].share, left.moment[0].share
    out["penetration"] = max(0.0, -float(t.above.min()))
    out["peak_force"] = float(t.force[:, :, 2].max())
    out["peak_foot_force"] = float(t.foot_force.max())
    if t.has_torques:
        out["peak_torque"] = max(float(t.u.max()), -float(t.u.min()))
    if t.link_speed is not None:
        out["link_speed"] = math.sqrt(float(t.link_speed[0].max()))
    if t.pushes:
        out |= pushed.pushed(t)
    span = span_of(t, window)
    if span is not None:
        out |= gait.stride(t, span) | energy.transport(t, span) | gait.contact(t, span) | belief.switches(t, span)
        out |= belief.inferred(t, span) | energy.motor_load(t, span, gait.travelled(t, span))
        out |= gait.tracking(t, span)
        if not t.robot.planar:
            out |= gait.sideways(t, span)
        if (states := t.believed_states) is not None:
            out["leg_states"] = belief.commonest_cycle(states[span, 0])
        if t.signal_names:
            out["signals"] = {name: spread(values[span]) for name, values in t.signals.items()}
    return out


def span_of(t: Trajectory, window: tuple[float, float]) -> slice | None:
    """Rows of a window [s]; None if it has less than two."""
    first = int(np.searchsorted(t.time, window[0] - 1e-9))
    last = min(int(np.searchsorted(t.time, window[1] + 1e-9, side="right")), len(t))
    return slice(first, last) if last - first > 1 else None


BLOCK = 1 << 16
"""Numbers that are added up at a time."""


class RunningMean:
    """The mean of numbers that come in pieces, without those that do not exist.

    Its digits depend on the numbers in their order, not on where the pieces end: blocks of a fixed length are added up
    by themselves, their sums without rounding.
    """

    def __init__(self):
        self._held: list[np.ndarray] = []
        self._waiting = 0
        self._sums: list[float] = []
        self._count = 0

    def add(self, values: np.ndarray) -> None:
        """More numbers."""
        finite = values[np.isfinite(values)]
        self._count += finite.size
        while self._waiting + finite.size >= BLOCK:
            room = BLOCK - self._waiting
            self._held.append(finite[:room])
            self._sums.append(float(np.add.reduce(np.concatenate(self._held))))
            self._held, self._waiting, finite = [], 0, finite[room:]
        if finite.size:
            self._held.append(finite)
            self._waiting += finite.size

    @property
    def value(self) -> float:
        """The mean so far; nan of nothing."""
        rest = [float(np.add.reduce(np.concatenate(self._held)))] if self._held else []
        try:
            return math.fsum(self._sums + rest) / self._count if self._count else math.nan
        except OverflowError:
            return math.inf


class Totals:
    """Numbers of an ensemble whose runs come in pieces: counts of outcomes, and means over the runs that walked.

    Where none walked, means are over the runs that have the number; nan if none has.

    Args:
        names: The metrics that are asked for; default: all.
    """

    def __init__(self, names: Iterable[str] = METRICS):
        metrics = [METRICS[name] for name in names]
        self._names = [metric.name for metric in metrics]
        self._counts = {metric.name: 0 for metric in metrics if metric.kind == "count"} | {"walked": 0}
        means = [metric.name for metric in metrics if metric.kind != "count"]
        self._walkers = {name: RunningMean() for name in means}
        self._all = {name: RunningMean() for name in means}
        self.runs = 0

    def add(self, columns: Mapping[str, np.ndarray]) -> None:
        """More runs.

        Args:
            columns: (n,) values by metric; `walked` and every metric that was asked for.
        """
        walked = columns["walked"].astype(bool)
        self.runs += walked.size
        for name in self._counts:
            self._counts[name] += int(columns[name].sum())
        if not self._counts["walked"]:
            for name, mean in self._all.items():
                mean.add(columns[name])
        elif walked.any():
            for name, mean in self._walkers.items():
                mean.add(columns[name][walked])

    @property
    def numbers(self) -> dict[str, float]:
        """Counts, and means over the runs that walked; where none did, over all that have the number."""
        means = self._walkers if self._counts["walked"] else self._all
        return {name: self._counts[name] if name in self._counts else means[name].value for name in self._names}
