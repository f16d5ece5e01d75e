"""Pure functions of a trajectory: what a run's numbers are, over the scenario's window.

`measure` gives every number of a run under the names of `NAMES`; `aggregate` those of an ensemble.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.tree import motion

NAMES: dict[str, str] = {
    "falls": "runs that fell or diverged",
    "walked": "runs that stayed up and went on walking (a human further than 0.2 m/s x duration, faster than 0.3 m/s)",
    "stood": "runs that stayed up and stood still in the window (no foot strike, torso within 0.1 m of its mean place)",
    "time": "s simulated",
    "distance": "m travelled by the torso along the ground",
    "speed": "m/s, mean over the window",
    "speed_std": "m/s, standard deviation of the torso's forward velocity over the window",
    "froude": "speed / sqrt(g leg length)",
    "step_length": "m, heel to heel at foot strike",
    "step_frequency": "1/s",
    "steps": "foot strikes in the window",
    "double_support": "fraction of the window with both feet on the ground",
    "flight": "fraction of the window with neither",
    "cost_of_transport": "net: integral of |sum of joint powers| / (weight x distance)",
    "cost_of_transport_absolute": "integral of the sum of |joint powers| / (weight x distance)",
    "cost_of_transport_positive": "integral of the positive joint powers / (weight x distance)",
    "peak_torque": "N m, largest joint torque",
    "mean_torque": "N m, mean of |joint torque|",
    "saturation": "fraction of ticks with a torque at its limit",
    "peak_power": "W, largest joint power",
    "torque_rate": "N m/ms, mean of the largest change of a joint torque from tick to tick",
    "switches": "1/s, changes of leg state",
    "constraint_switches": "1/s, changes of the set of rows in A",
    "peak_force": "N, largest normal force of a point",
    "support": "mean normal ground force / weight",
    "centre_of_pressure": "mean place of the ground force under a foot, 0 heel … 1 toe",
    "slip": "m of sliding of loaded points per m travelled",
    "penetration": "m, deepest point",
    "clearance": "m, lowest toe or heel in the middle half of a swing",
    "torso_lean": "degrees, mean lean of the torso from the vertical, forward positive",
    "torso_sway": "degrees, standard deviation of it",
    "energy_residual": "energy that work and losses do not explain / positive work",
    "contact_loss": "W, mean power lost in ground contacts",
}
"""Every metric and what it is; also the names that [expect] and [thesis] may use."""

_STILL = 0.1
"""[m] that a standing biped's torso may sway either way."""


def measure(t: Trajectory, window: tuple[float, float]) -> dict[str, Any]:
    """Every metric of one run.

    Args:
        t: The run.
        window: [s] start and end of the interval that means are taken over; a run that ended before it has nan there.

    Returns:
        Name to number; `falls`, `walked` and `stood` are 0 or 1. `per_joint` holds peak and mean torque of hip, knee
        and ankle, `leg_states` the commonest cycle of leg states and its share of all cycles.
    """
    from biped.measure.metrics import energy, gait, ground

    whole = motion(t.tree, t.q, t.v)
    inside = (t.time >= window[0] - 1e-9) & (t.time <= window[1] + 1e-9)
    span = slice(int(np.argmax(inside)), int(inside.size - np.argmax(inside[::-1]))) if inside.sum() > 1 else None
    out: dict[str, Any] = {name: math.nan for name in NAMES}
    seconds = len(t) * t.tick
    out["time"] = seconds if t.end == "completed" else float(t.time[-1])
    out["distance"] = float(t.q[-1, 0] - t.q[0, 0])
    out["stood"] = 0
    out["falls"] = int(t.end != "completed")
    out["energy_residual"] = energy.residual(t)
    out["penetration"] = float(max(0.0, -whole.point[..., 1].min()))
    out["peak_force"] = float(t.force[..., 1].max())
    out["peak_torque"] = float(np.abs(t.u).max())
    if span is not None:
        out |= gait.stride(t, whole, span)
        out |= energy.transport(t, whole, span)
        out |= ground.contact(t, whole, span)
        out["leg_states"] = gait.commonest_cycle(t, span)
        out["per_joint"] = energy.per_joint(t, span)
        away = np.abs(t.q[span, 0] - t.q[span, 0].mean()).max()
        out["stood"] = int(t.end == "completed" and out["steps"] == 0 and away < _STILL)
    out["walked"] = int(
        not out["falls"]
        and out["distance"] > t.robot.walked.distance * seconds
        and out["speed"] > t.robot.walked.speed  # nan compares false
    )
    return out


def aggregate(runs: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Numbers of an ensemble: falls, walked and stood are counted; all else is the mean over runs that walked.

    Where none walked, means are over the runs that have the number; nan if none has.
    """
    out: dict[str, float] = {}
    walkers = [run for run in runs if run["walked"]]
    for name in NAMES:
        if name in ("falls", "walked", "stood"):
            out[name] = int(sum(run[name] for run in runs))
            continue
        values = [run[name] for run in (walkers or runs) if math.isfinite(run[name])]
        out[name] = float(np.mean(values)) if values else math.nan
    return out
