"""Torques, powers, costs of transport; and how far energy and momentum are accounted for."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.general.gait import travelled
from biped.measure.general.trajectory import GeneralTrajectory
from biped.measure.verdict import LEAST_TIME
from biped.robot.build import frame
from biped.robot.gravity import GRAVITY
from biped.scenario.section import LARGEST


def powers(t: GeneralTrajectory) -> np.ndarray:
    """(n - 1, nu) [W] of the actuators between the rows: mean torque, mean velocity."""
    rate = t.v[:, t.robot.columns]
    return t.u[:-1] * 0.5 * (rate[:-1] + rate[1:])


def transport(t: GeneralTrajectory, span: slice) -> dict[str, float]:
    """Costs of transport and torques over a span of rows; of generalized forces the net cost alone."""
    weight = t.robot.mass * GRAVITY * travelled(t, span)
    if t.generalized:
        return {"cost_of_transport": float(np.abs(t.given[span][:-1]).sum() / weight)}
    u, power = t.u[span], powers(t)[span.start : span.stop - 1]
    limit = np.array(t.torque_limit)
    energy = t.tick / weight
    jump = np.abs(np.diff(u, axis=0)).max(axis=1)
    return {
        "cost_of_transport": float(np.abs(power.sum(axis=1)).sum() * energy),
        "cost_of_transport_absolute": float(np.abs(power).sum() * energy),
        "cost_of_transport_positive": float(np.maximum(power, 0.0).sum() * energy),
        "mean_torque": float(np.abs(u).mean()),
        "rms_torque": float(np.sqrt((u**2).mean(axis=0)).max()),
        "peak_power": float(np.abs(power).max()),
        "torque_rate": float(jump.mean() * 1e-3 / t.tick),
        "saturation": float((np.abs(u) >= limit * (1.0 - 1e-9)).any(axis=1).mean()) if limit.min() < LARGEST else 0.0,
    }


def per_joint(t: GeneralTrajectory, span: slice) -> dict[str, dict[str, float]]:
    """Peak and mean |torque| [N m] and peak |power| [W] of each actuator over a span of rows."""
    u, power = np.abs(t.u[span]), np.abs(powers(t)[span.start : span.stop - 1])
    return {
        name: {
            "peak_torque": float(u[:, i].max()),
            "mean_torque": float(u[:, i].mean()),
            "peak_power": float(power[:, i].max()),
        }
        for i, name in enumerate(t.robot.actuators)
    }


def residual(t: GeneralTrajectory) -> float:
    """What work leaves unexplained of the change of energy, relative to the work put in.

    Where little is done it is relative to the largest kinetic energy of the whole robot's mass, at least to a hundredth
    of the energy of the start.
    """
    if len(t) < 2:
        return 0.0
    left = t.energy[-1] - t.energy[0] - t.work[:-1].sum()
    return float(abs(left) / max(np.abs(t.given[:-1]).sum(), _moving(t), 1e-2 * abs(t.energy[0])))


def from_nowhere(t: GeneralTrajectory) -> float:
    """Most energy that the robot ever had beyond what it started with and what actuators and pushes put in.

    Returns:
        A share of what was put in, of its largest kinetic energy or of a tenth of the start's energy: the most.
    """
    if len(t) < 2:
        return 0.0
    beyond = t.energy[1:] - t.energy[0] - np.cumsum(t.given[:-1])
    most = max(float(beyond.max()), 0.0)
    return most / max(float(np.abs(t.given[:-1]).sum()), _moving(t), 0.1 * abs(float(t.energy[0])))


def _moving(t: GeneralTrajectory) -> float:
    """[J] largest kinetic energy of the whole mass in its centre."""
    return 0.5 * t.robot.mass * float((t.com_velocity**2).sum(axis=1).max())


def momentum_residual(t: GeneralTrajectory) -> float:
    """What ground, gravity and pushes leave unexplained of the momentum along the ground's normal; see `verdict`."""
    if len(t) < 2:
        return 0.0
    count, weight = len(t) - 1, -t.robot.mass * t.gravity[2]
    turn = frame(t.slope, t.side_slope)
    push = pushed = 0.0
    for start, end, forward, left, up, _ in t.pushes:
        ticks = max(0, min(round(end / t.tick), count) - round(start / t.tick))
        normal = ticks * float(turn[2] @ [forward, left, up])
        push, pushed = push + normal, pushed + abs(normal)
    force = float(t.ground_force[:-1, 2].sum())
    change = t.robot.mass * float(t.com_velocity[-1, 2] - t.com_velocity[0, 2]) / t.tick
    off = change - (force + push - weight * count)
    return abs(off) / max(weight * max(count, LEAST_TIME / t.tick), abs(force), pushed)


def heaviest(t: GeneralTrajectory) -> float:
    """[N m] largest torque; nan of generalized forces."""
    return math.nan if t.generalized else float(np.abs(t.u).max())
