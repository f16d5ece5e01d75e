"""Torques, powers, cost of transport and the energy balance."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.metrics.gait import strikes
from biped.measure.trajectory import Trajectory
from biped.robot.model import GRAVITY, gravity
from biped.robot.topology import ANKLE, BASE, HIP, KNEE, PITCH, SEGMENTS, THIGH, TORSO
from biped.robot.tree import Motion, Tree, motion


def energy(tree: Tree, q: np.ndarray, v: np.ndarray, slope: float) -> np.ndarray:
    """Kinetic and potential energy [J] of configurations (…, 9)."""
    m = motion(tree, q, v)
    kinetic = 0.5 * (tree.mass * (m.com_velocity**2).sum(axis=-1)).sum(axis=-1)
    kinetic += 0.5 * (tree.inertia * m.rate**2).sum(axis=-1) + 0.5 * (tree.armature * v[..., BASE:] ** 2).sum(axis=-1)
    potential = -(tree.mass * (m.com @ np.array(gravity(slope)))).sum(axis=-1)
    return kinetic + potential


def _steps(t: Trajectory) -> tuple[np.ndarray, Motion]:
    """Mean velocities (n - 1, 9) of the steps between rows, and the motion they make of the first configuration.

    A force F over a step changes the kinetic energy by F · (v + v')/2 · dt, impacts included.
    """
    mean = 0.5 * (t.v[:-1] + t.v[1:])
    return mean, motion(t.tree, t.q[:-1], mean)


def _push_power(t: Trajectory, moved: Motion) -> np.ndarray:
    """Power (n - 1,) [W] of the pushes."""
    power = np.zeros(len(t) - 1)
    angle = np.radians(t.slope)
    for start, end, forward, up, body in t.pushes:
        if body not in t.robot.links:
            continue
        force = np.array([forward * np.cos(angle) + up * np.sin(angle), up * np.cos(angle) - forward * np.sin(angle)])
        at = t.robot.links.index(body)
        first, last = round(start / t.tick), round(end / t.tick)
        power[first:last] += moved.com_velocity[first:last, at] @ force
    return power


def residual(t: Trajectory) -> float:
    """What work and losses leave unexplained of the change of energy, relative to the work put in.

    Change of energy = work of the actuators, pushes, knee stops, joint damping and ground forces, up to integration
    error.
    """
    if len(t) < 2:
        return 0.0
    mean, moved = _steps(t)
    actuators = (t.applied[:-1] * mean).sum(axis=1)
    pushes = _push_power(t, moved)
    stops = t.stop[:-1, 0] * mean[:, KNEE[0]] + t.stop[:-1, 1] * mean[:, KNEE[1]]
    damping = -(t.tree.damping * mean[:, BASE:] ** 2).sum(axis=1)
    ground = (t.force[:-1] * moved.point_velocity).sum(axis=(1, 2))
    e = energy(t.tree, t.q[[0, -1]], t.v[[0, -1]], t.slope)
    work = t.tick * (actuators + pushes + stops + damping + ground).sum()
    scale = t.tick * (np.abs(actuators) + np.abs(pushes)).sum()
    return float(abs(e[1] - e[0] - work) / max(scale, abs(e[0]) * 1e-3))


def loss_per_step(t: Trajectory, window: tuple[float, float]) -> float:
    """Energy [J] that each step loses in impacts, sliding and knee stops over a window [s] of whole strides.

    Work of the actuators, which is exactly what they apply times how far the coordinates move in a tick, less joint
    damping and the change of energy: no force needs to be resolved in time. (Not for windows with pushes.)
    """
    first, last = (round(time / t.tick) for time in window)
    work = float((t.applied[first:last] * np.diff(t.q[first : last + 1], axis=0)).sum())
    damped = float((t.tree.damping * t.v[first:last, BASE:] ** 2).sum() * t.tick)
    before, after = energy(t.tree, t.q[[first, last]], t.v[[first, last]], t.slope)
    steps = sum(first < row <= last for row, _ in strikes(t.phase))
    return (work - damped - float(after - before)) / steps if steps else math.nan


def transport(t: Trajectory, whole: Motion, span: slice) -> dict[str, float]:
    """The three costs of transport, torques and losses over a span of rows.

    The thesis's c_mt matches |sum of joint powers|; the other two are what hardware pays.
    """
    u, rate = t.u[span], t.v[span, BASE:]
    power = u * rate
    distance = float(t.q[span, 0][-1] - t.q[span, 0][0])
    # A walker that got nowhere has no cost of transport.
    weight = float(t.tree.mass.sum()) * GRAVITY * abs(distance) / t.tick or math.nan
    if t.generalized:
        # Q_d's virtual actuators: torso and thighs to the inertial frame, knees and ankles between links.
        Q, v = t.Q_d[span], t.v[span]
        rates = whole.rate[span]
        powers = [(Q[:, PITCH] - Q[:, HIP[0]] - Q[:, HIP[1]]) * rates[:, TORSO]]
        for hip, knee, ankle, thigh in zip(HIP, KNEE, ANKLE, THIGH, strict=True):
            powers += [Q[:, hip] * rates[:, thigh], Q[:, knee] * v[:, knee], Q[:, ankle] * v[:, ankle]]
        power = np.column_stack(powers)
    ground = (t.force[span] * whole.point_velocity[span]).sum(axis=(1, 2))
    jumps = np.abs(np.diff(u, axis=0)).max(axis=1)
    return {
        "cost_of_transport": float(np.abs(power.sum(axis=1)).sum() / weight),
        "cost_of_transport_absolute": float(np.abs(power).sum() / weight),
        "cost_of_transport_positive": float(np.maximum(power, 0.0).sum() / weight),
        "mean_torque": float(np.abs(u).mean()),
        "peak_power": float(np.abs(power).max()),
        "torque_rate": float(jumps.mean() * 1e-3 / t.tick),
        "saturation": float((np.abs(u) >= np.array(t.torque_limit)).any(axis=1).mean()),
        "contact_loss": float(-ground.mean()),
    }


def per_joint(t: Trajectory, span: slice) -> dict[str, dict[str, float]]:
    """Peak and mean |torque| [N m] and peak |power| [W] of hip, knee and ankle, both legs together."""
    u, power = np.abs(t.u[span]), np.abs(t.u[span] * t.v[span, BASE:])
    return {
        name: {
            "peak_torque": float(u[:, [i, i + SEGMENTS]].max()),
            "mean_torque": float(u[:, [i, i + SEGMENTS]].mean()),
            "peak_power": float(power[:, [i, i + SEGMENTS]].max()),
        }
        for i, name in enumerate(("hip", "knee", "ankle"))
    }
