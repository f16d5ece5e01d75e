"""Pure functions of a trajectory: what a run's numbers are, over the scenario's window.

`assess` judges a run and gives every number of `biped.scenario.metrics.METRICS`; `aggregate` those of an ensemble.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from biped.measure import verdict
from biped.measure.metrics import energy, gait, ground, motors, posture, pushed
from biped.measure.metrics.outcome import outcome_of, spread, stopped
from biped.measure.metrics.sums import Sums, add_up
from biped.measure.metrics.totals import Totals
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
    with np.errstate(all="ignore"):  # numbers of a run that blows up; what comes of them is judged
        sums = add_up(t, window)
        if sums.fast is not None:
            said = verdict.too_fast(t, sums.fast)
            cause = f"{said}; {t.cause}" if t.cause else said
            t = t.rows(slice(len(sums.point)), end="diverged", cause=cause)
        numbers = _numbers(t, sums)
        judged = verdict.verdict_on(t, numbers)
    outcome = outcome_of(t, numbers, judged.verdict)
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


def _numbers(t: Trajectory, sums: Sums) -> dict[str, Any]:
    """All but the outcome."""
    run = sums.run
    out: dict[str, Any] = dict.fromkeys(METRICS, math.nan)
    out["time"] = len(t) * t.tick if t.end == "completed" else float(t.time[-1])
    out["distance"] = float(t.q[-1, 0] - t.q[0, 0])
    out["energy_residual"] = energy.residual(t, run)
    out["energy_from_nowhere"] = energy.from_nowhere(t, run)
    out["momentum_residual"] = verdict.momentum_residual(t, tuple(run["momentum"].tolist()), float(run["impulse"]))
    out["penetration"] = max(0.0, float(run["depth"]))
    out["peak_force"] = float(run["normal"])
    out["peak_torque"] = float(run["torque"])
    out["link_speed"] = math.sqrt(run["squared"])
    if t.pushes:
        out |= pushed.pushed(t, sums.point)
    if sums.span is not None:
        out |= gait.stride(t, sums)
        out |= energy.transport(t, sums)
        out |= ground.contact(t, sums)
        out |= posture.inferred(t, sums.span)
        out |= motors.load(t, sums.span, gait.travelled(sums))
        out["leg_states"] = gait.commonest_cycle(t, sums.span)
        out["per_joint"] = energy.per_joint(sums)
        if t.signal_names:
            out["signals"] = {name: spread(values[sums.span]) for name, values in t.signals.items()}
    return out


def aggregate(runs: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Numbers of an ensemble: outcomes are counted; all else is the mean over runs that walked.

    Where none walked, means are over the runs that have the number; nan if none has.
    """
    totals = Totals()
    totals.add({name: np.array([run[name] for run in runs], dtype=float) for name in METRICS})
    return totals.numbers
