"""Torques, powers, cost of transport and the energy balance."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.metrics.gait import strikes, travelled
from biped.measure.trajectory import Trajectory
from biped.robot.model import GRAVITY, gravity
from biped.robot.topology import ANKLE, BASE, HIP, KNEE, NQ, PITCH, SEGMENTS, THIGH, TORSO
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
    for first, last, force, at in _pushes(t):
        power[first:last] += moved.com_velocity[first:last, at] @ force
    return power


def push_work(t: Trajectory) -> float:
    """Work [J] of the pushes on the robot: what it has to absorb."""
    return float(_push_power(t, _steps(t)[1]).sum() * t.tick) if len(t) > 1 else 0.0


def _pushes(t: Trajectory) -> list[tuple[int, int, np.ndarray, int]]:
    """Pushes on links: first row, last row + 1, force (2,) [N] along and normal to the ground, number of the link."""
    c, s = math.cos(math.radians(t.slope)), math.sin(math.radians(t.slope))
    return [
        (round(start / t.tick), round(end / t.tick), np.array([forward * c + up * s, up * c - forward * s]),
         t.robot.links.index(body))
        for start, end, forward, up, body in t.pushes if body in t.robot.links
    ]  # fmt: skip


def residual(t: Trajectory, squared: np.ndarray | None = None) -> float:
    """What work and losses leave unexplained of the change of energy, relative to the work put in.

    Change of energy = work of the actuators, pushes, knee stops, joint damping and ground forces, up to integration
    error. Where little work is done, as in a fall or a flight, it is relative to the largest kinetic energy of the
    centres of mass; at least to a hundredth of the energy of the start.

    Args:
        t: The run.
        squared: (n, 7) [m²/s²] squares of the speeds of the links' centres of mass, if they are known.
    """
    if len(t) < 2:
        return 0.0
    mean, moved = _steps(t)
    applied = t.Q_d[:-1] if t.generalized else t.u[:-1]
    actuators = np.einsum("ij,ij->i", applied, mean[:, NQ - applied.shape[1] :])
    pushes = _push_power(t, moved)
    stops = t.stop[:-1, 0] * mean[:, KNEE[0]] + t.stop[:-1, 1] * mean[:, KNEE[1]]
    damping = -np.einsum("j,ij,ij", t.tree.damping, mean[:, BASE:], mean[:, BASE:])
    ground = np.einsum("ijk,ijk", t.force[:-1], moved.point_velocity)
    e = energy(t.tree, t.q[[0, -1]], t.v[[0, -1]], t.slope)
    work = t.tick * ((actuators + pushes + stops).sum() + damping + ground)
    put_in = t.tick * (np.abs(actuators) + np.abs(pushes)).sum()
    if squared is None:
        squared = (motion(t.tree, t.q, t.v).com_velocity ** 2).sum(axis=-1)
    moving = 0.5 * (squared @ t.tree.mass).max()
    return float(abs(e[1] - e[0] - work) / max(put_in, moving, abs(e[0]) * 1e-2))


def from_nowhere(t: Trajectory, whole: Motion, squared: np.ndarray) -> float:
    """Most energy that the biped ever had beyond what it started with and what actuators and pushes put in.

    Ground, stops and joint damping only take: they may give back what they took, no more. No force of theirs is needed
    for this, and work is exactly what was applied times how far the coordinates went, so that it holds where forces
    are `sampled`, and where they do account for what a bad solution of the contacts gave away.

    Args:
        t: The run.
        whole: How its rows move.
        squared: (n, 7) [m²/s²] squares of the speeds of the links' centres of mass.

    Returns:
        A share of what was put in, of the largest kinetic energy or of a tenth of the start's energy, whichever is
        more.
    """
    if len(t) < 2:
        return 0.0
    applied = t.Q_d[:-1] if t.generalized else t.u[:-1]
    put_in = np.einsum("ij,ij->i", applied, np.diff(t.q[:, NQ - applied.shape[1] :], axis=0))
    for first, last, force, at in _pushes(t):
        put_in[first:last] += np.diff(whole.com[:, at], axis=0)[first:last] @ force
    moving = 0.5 * (squared @ t.tree.mass)
    spinning = 0.5 * (whole.rate**2 @ t.tree.inertia + t.v[:, BASE:] ** 2 @ t.tree.armature)
    g = np.array(gravity(t.slope))
    level = -(t.tree.mass @ whole.com) @ g
    total = moving + spinning + level
    most = (total[1:] - total[0] - np.cumsum(put_in)).max()
    return float(max(most, 0.0) / max(np.abs(put_in).sum(), moving.max(), 0.1 * abs(total[0])))


def loss_per_step(t: Trajectory, window: tuple[float, float]) -> float:
    """Energy [J] that each step loses in impacts, sliding and knee stops over a window [s] of whole strides.

    Work of the actuators, which is exactly what they apply times how far the coordinates move in a tick, less joint
    damping and the change of energy: no force needs to be resolved in time. (Not for windows with pushes.)
    """
    first, last = (round(time / t.tick) for time in window)
    work = float((t.applied[first:last] * np.diff(t.q[first : last + 1], axis=0)).sum())
    damped = float((t.tree.damping * t.v[first:last, BASE:] ** 2).sum() * t.tick)
    before, after = energy(t.tree, t.q[[first, last]], t.v[[first, last]], t.slope)
    steps = sum(first < row <= last for row, _ in strikes(t.phase, t.tick))
    return (work - damped - float(after - before)) / steps if steps else math.nan


def transport(t: Trajectory, whole: Motion, span: slice) -> dict[str, float]:
    """The three costs of transport, torques and losses over a span of rows.

    The thesis's c_mt matches |sum of joint powers|; the other two are what hardware pays.
    """
    u, rate = t.u[span], t.v[span, BASE:]
    power = u * rate
    weight = float(t.tree.mass.sum()) * GRAVITY * travelled(t, span) / t.tick
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
