"""Every number of a run of a robot of any kind: the metrics of `biped.scenario.metrics` that it has."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from biped.measure import verdict
from biped.measure.general import energy, gait, ground, pushed
from biped.measure.general.trajectory import GeneralTrajectory
from biped.measure.metrics.outcome import outcome_of, spread, stopped
from biped.scenario.metrics import METRICS


class Assessed(NamedTuple):
    """A run and its numbers; see `biped.measure.metrics.Assessed`."""

    trajectory: GeneralTrajectory
    numbers: dict[str, Any]


def assess(t: GeneralTrajectory, window: tuple[float, float]) -> Assessed:
    """Judges a run (`biped.measure.verdict`) and measures it.

    Args:
        t: The run.
        window: [s] start and end of the interval that means are taken over; a run that ended before it has nan there.
    """
    if t.end == "diverged":
        sound = t.sound & (np.diff(t.time, prepend=-1.0) > 0.0)
        t = t.rows(slice(max(1, int(sound.cumprod().sum()))))
    with np.errstate(all="ignore"):  # numbers of a run that blows up; what comes of them is judged
        numbers = _numbers(t, window)
        judged = verdict.verdict_on(t, numbers)
    outcome = outcome_of(t, numbers, judged.verdict)
    return Assessed(t, numbers | outcome | stopped(t, outcome) | judged._asdict())


def _numbers(t: GeneralTrajectory, window: tuple[float, float]) -> dict[str, Any]:
    out: dict[str, Any] = dict.fromkeys(METRICS, math.nan)
    out["time"] = len(t) * t.tick if t.end == "completed" else float(t.time[-1])
    out["distance"] = float(t.base[-1, 0] - t.base[0, 0])
    out["energy_residual"] = energy.residual(t)
    out["energy_from_nowhere"] = energy.from_nowhere(t)
    out["momentum_residual"] = energy.momentum_residual(t)
    out["penetration"] = max(0.0, -float(t.above.min()))
    out["peak_force"] = float(t.force[:, :, 2].max())
    out["peak_torque"] = energy.heaviest(t)
    if t.pushes:
        out |= pushed.pushed(t)
    first = int(np.searchsorted(t.time, window[0] - 1e-9))
    last = min(int(np.searchsorted(t.time, window[1] + 1e-9, side="right")), len(t))
    if last - first > 1:
        span = slice(first, last)
        out |= gait.stride(t, span) | energy.transport(t, span) | ground.contact(t, span)
        out["per_joint"] = {} if t.generalized else energy.per_joint(t, span)
        if t.signal_names:
            out["signals"] = {name: spread(values[span]) for name, values in t.signals.items()}
    return out
