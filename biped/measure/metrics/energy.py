"""Torques, powers, cost of transport and the energy balance."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.metrics.gait import strikes, travelled
from biped.measure.trajectory import Trajectory
from biped.robot.model import GRAVITY, gravity
from biped.robot.tree import Motion, Tree, motion


def energy(tree: Tree, q: np.ndarray, v: np.ndarray, slope: float) -> np.ndarray:
    """Kinetic and potential energy [J] of configurations (…, 9)."""
    m = motion(tree, q, v)
    kinetic = 0.5 * (tree.mass * (m.com_velocity**2).sum(axis=-1)).sum(axis=-1)
    kinetic += 0.5 * (tree.inertia * m.rate**2).sum(axis=-1) + 0.5 * (tree.armature * v[..., 3:] ** 2).sum(axis=-1)
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
    from biped.robot.tree import LINKS

    power = np.zeros(len(t) - 1)
    angle = np.radians(t.slope)
    for start, end, forward, up, body in t.pushes:
        if body not in LINKS:
            continue
        force = np.array([forward * np.cos(angle) + up * np.sin(angle), up * np.cos(angle) - forward * np.sin(angle)])
        at = LINKS.index(body)
        first, last = round(start / t.tick), round(end / t.tick)
        power[first:last] += moved.com_velocity[first:last, at] @ force
    return power


def residual(t: Trajectory, whole: Motion | None = None) -> float:
    """What work and losses leave unexplained of the change of energy, relative to the work put in.

    Change of energy = work of the actuators, pushes, knee stops, joint damping and ground forces, up to integration
    error. Where little work is done, as in a fall or a flight, it is relative to the largest kinetic energy of the
    centres of mass; at least to a hundredth of the energy of the start.

    Args:
        t: The run.
        whole: How its rows move, if that is known.
    """
    if len(t) < 2:
        return 0.0
    mean, moved = _steps(t)
    actuators = (t.applied[:-1] * mean).sum(axis=1)
    pushes = _push_power(t, moved)
    stops = t.stop[:-1, 0] * mean[:, 4] + t.stop[:-1, 1] * mean[:, 7]
    damping = -(t.tree.damping * mean[:, 3:] ** 2).sum(axis=1)
    ground = (t.force[:-1] * moved.point_velocity).sum(axis=(1, 2))
    e = energy(t.tree, t.q[[0, -1]], t.v[[0, -1]], t.slope)
    work = t.tick * (actuators + pushes + stops + damping + ground).sum()
    put_in = t.tick * (np.abs(actuators) + np.abs(pushes)).sum()
    velocity = (motion(t.tree, t.q, t.v) if whole is None else whole).com_velocity
    moving = 0.5 * ((velocity**2).sum(axis=-1) @ t.tree.mass).max()
    return float(abs(e[1] - e[0] - work) / max(put_in, moving, abs(e[0]) * 1e-2))


def loss_per_step(t: Trajectory, window: tuple[float, float]) -> float:
    """Energy [J] that each step loses in impacts, sliding and knee stops over a window [s] of whole strides.

    Work of the actuators, which is exactly what they apply times how far the coordinates move in a tick, less joint
    damping and the change of energy: no force needs to be resolved in time. (Not for windows with pushes.)
    """
    first, last = (round(time / t.tick) for time in window)
    work = float((t.applied[first:last] * np.diff(t.q[first : last + 1], axis=0)).sum())
    damped = float((t.tree.damping * t.v[first:last, 3:] ** 2).sum() * t.tick)
    before, after = energy(t.tree, t.q[[first, last]], t.v[[first, last]], t.slope)
    steps = sum(first < row <= last for row, _ in strikes(t.phase, t.tick))
    return (work - damped - float(after - before)) / steps if steps else math.nan


def transport(t: Trajectory, whole: Motion, span: slice) -> dict[str, float]:
    """The three costs of transport, torques and losses over a span of rows.

    The thesis's c_mt matches |sum of joint powers|; the other two are what hardware pays.
    """
    u, rate = t.u[span], t.v[span, 3:]
    power = u * rate
    weight = float(t.tree.mass.sum()) * GRAVITY * travelled(t, span) / t.tick
    if t.generalized:
        # Q_d's virtual actuators: torso and thighs to the inertial frame, knees and ankles between links.
        Q, v = t.Q_d[span], t.v[span]
        rates = whole.rate[span]
        torso = (Q[:, 2] - Q[:, 3] - Q[:, 6]) * rates[:, 0]
        power = np.column_stack(
            [torso, Q[:, 3] * rates[:, 1], Q[:, 4] * v[:, 4], Q[:, 5] * v[:, 5],
             Q[:, 6] * rates[:, 4], Q[:, 7] * v[:, 7], Q[:, 8] * v[:, 8]]
        )  # fmt: skip
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
    u, power = np.abs(t.u[span]), np.abs(t.u[span] * t.v[span, 3:])
    return {
        name: {
            "peak_torque": float(u[:, [i, i + 3]].max()),
            "mean_torque": float(u[:, [i, i + 3]].mean()),
            "peak_power": float(power[:, [i, i + 3]].max()),
        }
        for i, name in enumerate(("hip", "knee", "ankle"))
    }
