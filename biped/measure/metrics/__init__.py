"""Pure functions of a trajectory: what a run's numbers are, over the scenario's window.

`assess` judges a run and gives every number of `biped.scenario.metrics.METRICS`; `aggregate` those of an ensemble.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from biped.measure import verdict
from biped.measure.metrics import energy, gait, ground, motors, posture, walking
from biped.measure.trajectory import Trajectory
from biped.robot.tree import Motion, motion
from biped.scenario.metrics import METRICS


class Assessed(NamedTuple):
    """A run and its numbers.

    Attributes:
        trajectory: The run with the end and the cause that its sentinels give it, and without the rows from where it
            blew up.
        numbers: Every metric by name; see `measure`.
    """

    trajectory: Trajectory
    numbers: dict[str, Any]


def assess(t: Trajectory, window: tuple[float, float]) -> Assessed:
    """Judges a run (`biped.measure.verdict`) and measures it; arguments as of `measure`."""
    if t.end == "diverged":
        # Rows from where a number stopped being finite say nothing; the last was not written.
        sound = np.isfinite(t.log).all(axis=1) & (np.diff(t.time, prepend=-1.0) > 0.0)
        t = t.rows(slice(max(1, int(sound.cumprod().sum()))))
    with np.errstate(all="ignore"):  # numbers of a run that blows up; what comes of them is judged
        whole = motion(t.tree, t.q, t.v)
        squared = whole.com_velocity[..., 0] ** 2 + whole.com_velocity[..., 1] ** 2
        fast = verdict.too_fast(t, whole, squared)
        if fast is not None:
            rows = slice(0, max(1, fast.row))
            cause = f"{fast.cause}; {t.cause}" if t.cause else fast.cause
            t = t.rows(rows, end="diverged", cause=cause)
            whole, squared = Motion(*(part[rows] for part in whole)), squared[rows]
        numbers = _numbers(t, whole, squared, window)
        end, cause = verdict.ending(t, numbers)
    t = replace(t, end=end, cause=cause)
    return Assessed(t, numbers | _outcome(t, numbers))


def measure(t: Trajectory, window: tuple[float, float]) -> dict[str, Any]:
    """Every metric of one run.

    Args:
        t: The run.
        window: [s] start and end of the interval that means are taken over; a run that ended before it has nan there.

    Returns:
        Name to number; `falls`, `diverged`, `doubtful`, `walked` and `stood` are 0 or 1. `per_joint` holds peak and
        mean torque of hip, knee and ankle, `leg_states` the commonest cycle of leg states and its share of all cycles.
    """
    return assess(t, window).numbers


def _numbers(t: Trajectory, whole: Motion, squared: np.ndarray, window: tuple[float, float]) -> dict[str, Any]:
    """All but the outcome; `squared` (n, 7) [m²/s²] are squares of the links' speeds."""
    inside = (t.time >= window[0] - 1e-9) & (t.time <= window[1] + 1e-9)
    span = slice(int(np.argmax(inside)), int(inside.size - np.argmax(inside[::-1]))) if inside.sum() > 1 else None
    out: dict[str, Any] = dict.fromkeys(METRICS, math.nan)
    out["time"] = len(t) * t.tick if t.end == "completed" else float(t.time[-1])
    out["distance"] = float(t.q[-1, 0] - t.q[0, 0])
    out["energy_residual"] = energy.residual(t, squared)
    out["energy_from_nowhere"] = energy.from_nowhere(t, whole, squared)
    out["momentum_residual"] = verdict.momentum_residual(t, whole)
    out["penetration"] = float(max(0.0, -whole.point[..., 1].min()))
    out["peak_force"] = float(t.force[..., 1].max())
    out["peak_torque"] = float(np.abs(t.u).max())
    out["link_speed"] = math.sqrt(squared.max())
    if span is not None:
        out |= gait.stride(t, whole, span)
        out |= energy.transport(t, whole, span)
        out |= ground.contact(t, whole, span)
        out |= posture.inferred(t, span)
        out |= motors.load(t, span)
        out["leg_states"] = gait.commonest_cycle(t, span)
        out["per_joint"] = energy.per_joint(t, span)
    return out


def _outcome(t: Trajectory, numbers: dict[str, Any]) -> dict[str, int]:
    """What became of the run, each 0 or 1."""
    up = t.end == "completed"
    return {
        "falls": int(t.end in ("fell", "diverged")),
        "diverged": int(t.end == "diverged"),
        "doubtful": int(t.end == "doubtful"),
        "walked": int(up and walking.walked(numbers, len(t) * t.tick, t.robot.walked)),
        "stood": int(up and walking.stood(numbers)),
    }


def aggregate(runs: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Numbers of an ensemble: outcomes are counted; all else is the mean over runs that walked.

    Where none walked, means are over the runs that have the number; nan if none has.
    """
    out: dict[str, float] = {}
    walkers = [run for run in runs if run["walked"]]
    for metric in METRICS.values():
        if metric.kind == "count":
            out[metric.name] = int(sum(run[metric.name] for run in runs))
            continue
        values = [run[metric.name] for run in (walkers or runs) if math.isfinite(run[metric.name])]
        out[metric.name] = float(np.mean(values)) if values else math.nan
    return out
