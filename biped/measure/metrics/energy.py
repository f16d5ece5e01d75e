"""Torques, powers, costs of transport; and how far energy and momentum are accounted for."""

import math
from typing import Any, NamedTuple

import numpy as np

from biped.base.jit import entry_kernel
from biped.measure.metrics.gait import travelled
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory, mean_powers
from biped.robot.ground import GRAVITY, frame
from biped.robot.planar.topology import ANKLE, BASE, HIP, KNEE, PITCH, THIGH, TORSO
from biped.robot.planar.tree import motion

LEAST_TIME = 0.1
"""[s] of weight that the momentum residual is relative to at least: a fall in the second tick has no impulse yet."""


class Driven(NamedTuple):
    """Sums over the actuators in a span.

    Attributes:
        net: [W] sum over the steps from row to row of |sum of mean powers|: torque times the mean of the rates before
            and after the step.
        absolute: [W] sum of all |mean powers|.
        positive: [W] sum of the positive ones.
        saturated: Rows with a torque at its limit.
        torque: (nu,) [N m] sums of |torque|.
        squared: (nu,) [N² m²] sums of the torques' squares.
        most: (nu,) [N m] largest |torque|.
        power: (nu,) [W] largest |torque times rate| in a row.
    """

    net: float
    absolute: float
    positive: float
    saturated: int
    torque: np.ndarray
    squared: np.ndarray
    most: np.ndarray
    power: np.ndarray


def driven(t: Trajectory, span: slice) -> Driven:
    """Sums what the actuators did in a span of rows; tests/measure/referee.py says the same in NumPy."""
    each = np.zeros((4, len(t.robot.drives)))
    limit = np.array(t.torque_limit) * (1.0 - 1e-9)
    return Driven(*_driven(t.u[span], t.v[span], t.robot.columns, limit, *each), *each)


@entry_kernel
def _driven(u, v, columns, limit, torque, squared, most, power):
    net, absolute, positive, saturated = 0.0, 0.0, 0.0, 0
    for k in range(u.shape[0]):
        total, over = 0.0, False
        for j in range(u.shape[1]):
            one, rate = u[k, j], v[k, columns[j]]
            size = abs(one)
            torque[j] += size
            squared[j] += one * one
            most[j] = max(most[j], size)
            power[j] = max(power[j], abs(one * rate))
            over |= size >= limit[j]
            if k + 1 < u.shape[0]:
                mean = one * 0.5 * (rate + v[k + 1, columns[j]])
                total += mean
                absolute += abs(mean)
                positive += max(mean, 0.0)
        net += abs(total)
        saturated += over
    return net, absolute, positive, saturated


def transport(t: Trajectory, span: slice) -> dict[str, Any]:
    """Costs of transport and torques over a span of rows; of forces that are no joint's the net cost alone.

    The thesis's c_mt matches |sum of joint powers|; the other two are what hardware pays. A power is that of a torque
    at the mean of the rates before and after a step, which is what changes the kinetic energy: torques that switch, and
    impacts, change the rates within it.
    """
    weight = t.mass * GRAVITY * travelled(t, span)
    if not t.has_torques:
        return {"cost_of_transport": float(np.abs(t.input_work[span][:-1]).sum() / weight), "per_joint": {}}
    sums, energy = driven(t, span), t.tick / weight
    rows, net, absolute, positive, peak = span.stop - span.start, sums.net, sums.absolute, sums.positive, sums.power
    if t.generalized:
        forces, rates = _springs(t, span)
        power = mean_powers(forces, rates)
        net, absolute = float(np.abs(power.sum(axis=1)).sum()), float(np.abs(power).sum())
        positive, peak = float(np.maximum(power, 0.0).sum()), np.abs(forces * rates)
    return {
        "cost_of_transport": net * energy,
        "cost_of_transport_absolute": absolute * energy,
        "cost_of_transport_positive": positive * energy,
        "mean_torque": float(sums.torque.mean()) / rows,
        "rms_torque": math.sqrt(float(sums.squared.max()) / rows),
        "peak_power": float(peak.max()),
        **_jumps(t, span),
        "saturation": sums.saturated / rows,
        "per_joint": _per_joint(t, sums, rows),
    }


def _jumps(t: Trajectory, span: slice) -> dict[str, float]:
    """How torques change from row to row; no torque acts in the row of a fall, and not every loop logs one there."""
    decided = len(t) - (t.end in ("fell", "diverged"))
    changes = np.abs(np.diff(t.u[span.start : min(span.stop, decided)], axis=0))
    if not changes.size:
        return dict.fromkeys(("torque_rate", "torque_rate_99", "torque_jump"), math.nan)
    jumps = changes.max(axis=1)
    each = 1e-3 / t.tick
    return {
        "torque_rate": float(jumps.mean()) * each,
        "torque_rate_99": float(np.quantile(jumps, 0.99)) * each,
        "torque_jump": float(jumps.max()),
    }


def _springs(t: Trajectory, span: slice) -> tuple[np.ndarray, np.ndarray]:
    """(n, 7) torques [N m] and rates [rad/s] of Q_d's virtual actuators.

    Torso and thighs are turned against the inertial frame, knees and ankles against the link above.
    """
    Q, v = t.Q_d[span], t.v[span]
    turning = motion(t.tree, t.q[span], v).rate
    torques, rates = [Q[:, PITCH] - Q[:, HIP[0]] - Q[:, HIP[1]]], [turning[:, TORSO]]
    for hip, knee, ankle, thigh in zip(HIP, KNEE, ANKLE, THIGH, strict=True):
        torques += [Q[:, hip], Q[:, knee], Q[:, ankle]]
        rates += [turning[:, thigh], v[:, knee], v[:, ankle]]
    return np.column_stack(torques), np.column_stack(rates)


def _per_joint(t: Trajectory, sums: Driven, rows: int) -> dict[str, dict[str, float]]:
    """Peak and mean |torque| [N m] and peak |power| [W] of the actuators, group by group."""
    return {
        name: {
            "peak_torque": float(sums.most[drives].max()),
            "mean_torque": float(sums.torque[drives].sum()) / (len(drives) * rows),
            "peak_power": float(sums.power[drives].max()),
        }
        for name, drives in t.robot.drive_groups.items()
    }


def residual(t: Trajectory) -> float:
    """The change of energy that no work explains, relative to the work put in.

    Where little is done it is relative to the largest kinetic energy of the links' or the whole robot's mass, at least
    to the weight times the length of a leg: the energy that a fall turns into motion, step by step of the physics. In
    the worst fall of an honest run at 2 ms the steps make 0.55 % of that, in proportion to their length.
    """
    if len(t) < 2:
        return 0.0
    left = t.energy[-1] - t.energy[0] - t.work[:-1].sum()
    return float(abs(left) / max(t.spent[:-1].sum(), t.moving_energy.max(), t.mass * GRAVITY * t.robot.leg))


def from_nowhere(t: Trajectory) -> float:
    """Most energy that the robot ever had beyond what it started with and what actuators and pushes put in.

    Ground, stops and joint damping only take: they may give back what they took, no more. No force of theirs is needed
    for this, and what is given is exactly what was applied times how far the coordinates went, so that it holds where
    forces are `sampled`, and where they do account for what a bad solution of the contacts gave away.

    Returns:
        A share of what was put in, of its largest kinetic energy or of a tenth of the start's energy: the most.
    """
    if len(t) < 2:
        return 0.0
    beyond = t.energy[1:] - t.energy[0] - np.cumsum(t.input_work[:-1])
    most = max(float(beyond.max()), 0.0)
    put_in = float(np.abs(t.input_work[:-1]).sum())
    return most / max(put_in, float(t.moving_energy.max()), 0.1 * abs(float(t.energy[0])))


def momentum_residual(t: Trajectory) -> float:
    """The change of momentum along the ground's normal that ground, seat, gravity and pushes do not explain.

    Relative to the impulse of the weight, of `LEAST_TIME` at least, or of what acted if that is more.
    """
    if len(t) < 2:
        return 0.0
    count, weight = len(t) - 1, -t.mass * t.gravity[2]
    normal = frame(t.slope, t.side_slope)[2]
    push = pushed = 0.0
    for one in declared(t):
        ticks = max(0, min(round(one.end / t.tick), count) - round(one.start / t.tick))
        up = ticks * float(normal @ one.force)
        push, pushed = push + up, pushed + abs(up)
    force = float(t.ground_force[:-1, 2].sum()) + (0.0 if t.seat_force is None else float(t.seat_force[:-1, 1].sum()))
    change = t.mass * float(t.com_velocity[-1, 2] - t.com_velocity[0, 2]) / t.tick
    off = change - (force + push - weight * count)
    return abs(off) / max(weight * max(count, LEAST_TIME / t.tick), abs(force), pushed)


def loss_per_step(t: Trajectory, window: tuple[float, float]) -> float:
    """Energy [J] that each step loses in impacts, sliding and knee stops over a window [s] of whole strides.

    What the actuators give, which is exactly what they apply times how far the coordinates move in a tick, less joint
    damping and the change of energy: no force needs to be resolved in time. (Of seven links; not for windows with
    pushes.)
    """
    first, last = (round(time / t.tick) for time in window)
    damped = float((t.tree.damping * t.v[first:last, BASE:] ** 2).sum() * t.tick)
    steps = sum(first < row <= last for row, _ in t.strikes)
    lost = float(t.input_work[first:last].sum()) - damped - float(t.energy[last] - t.energy[first])
    return lost / steps if steps else math.nan


def motor_load(t: Trajectory, span: slice, distance: float) -> dict[str, float]:
    """Loads and electrical costs over a span of rows and a distance [m]; nothing of a robot without motors.

    The joint torques are what the gears deliver; the rotors' inertia and the joints' friction are the model's, so that
    the motors' torque is u / n, with the gear's loss on whichever side drives.
    """
    u, rate = t.u[span], t.rate[span]
    motor = t.robot.motor
    if motor is None or t.generalized:
        return {}
    rms = np.sqrt((u**2).mean(axis=0))
    current = motor.current(u, rate)
    heat = motor.resistance * current**2
    drawn = np.maximum(heat + motor.torque_constant * motor.ratio * rate * current, 0.0)
    weight = t.mass * GRAVITY * distance / t.tick
    line = motor.stall * (1.0 - np.sign(u) * rate / motor.free)
    return {
        "motor_load": float((rms / motor.rated).max()),
        "gear_load": float(np.abs(u).max() / motor.gear_peak),
        "beyond_gear": float((np.abs(u) > motor.gear_peak).any(axis=1).mean()),
        "beyond_line": float((np.abs(u) > line + 1e-9).any(axis=1).mean()),
        "cost_of_transport_heat": float(heat.sum() / weight),
        "cost_of_transport_electrical": float(drawn.sum() / weight),
    }
