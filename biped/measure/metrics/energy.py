"""Torques, powers, cost of transport and the energy balance."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.metrics.gait import travelled
from biped.measure.metrics.sums import Sums
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY, gravity
from biped.robot.planar.topology import BASE, LEGS, NU, SEGMENTS
from biped.robot.planar.tree import Tree, motion


def energy(tree: Tree, q: np.ndarray, v: np.ndarray, slope: float) -> np.ndarray:
    """Kinetic and potential energy [J] of configurations (…, 9)."""
    m = motion(tree, q, v)
    kinetic = 0.5 * (tree.mass * (m.com_velocity**2).sum(axis=-1)).sum(axis=-1)
    kinetic += 0.5 * (tree.inertia * m.rate**2).sum(axis=-1) + 0.5 * (tree.armature * v[..., BASE:] ** 2).sum(axis=-1)
    potential = -(tree.mass * (m.com @ np.array(gravity(slope)))).sum(axis=-1)
    return kinetic + potential


def residual(t: Trajectory, run: np.void) -> float:
    """What work and losses leave unexplained of the change of energy, relative to the work put in.

    Change of energy = work of the actuators, pushes, knee stops, joint damping and ground forces, up to integration
    error. Where little work is done, as in a fall or a flight, it is relative to the largest kinetic energy of the
    centres of mass; at least to a hundredth of the energy of the start.

    Args:
        t: The run.
        run: Its sums (`biped.measure.metrics.sums`).
    """
    if len(t) < 2:
        return 0.0
    first, last = run["energy"]
    left = last - first - t.tick * run["work"]
    return float(abs(left) / max(t.tick * run["put_in"], run["moving"], abs(first) * 1e-2))


def from_nowhere(t: Trajectory, run: np.void) -> float:
    """Most energy that the biped ever had beyond what it started with and what actuators and pushes put in.

    Ground, stops and joint damping only take: they may give back what they took, no more. No force of theirs is needed
    for this, and work is exactly what was applied times how far the coordinates went, so that it holds where forces
    are `sampled`, and where they do account for what a bad solution of the contacts gave away.

    Args:
        t: The run.
        run: Its sums.

    Returns:
        A share of what was put in, of the largest kinetic energy or of a tenth of the start's energy, whichever is
        more.
    """
    if len(t) < 2:
        return 0.0
    most = max(run["nowhere"], 0.0)
    return float(most / max(run["given_either_way"], run["moving"], 0.1 * abs(run["energy"][0])))


def loss_per_step(t: Trajectory, window: tuple[float, float]) -> float:
    """Energy [J] that each step loses in impacts, sliding and knee stops over a window [s] of whole strides.

    Work of the actuators, which is exactly what they apply times how far the coordinates move in a tick, less joint
    damping and the change of energy: no force needs to be resolved in time. (Not for windows with pushes.)
    """
    first, last = (round(time / t.tick) for time in window)
    work = float((t.applied[first:last] * np.diff(t.q[first : last + 1], axis=0)).sum())
    damped = float((t.tree.damping * t.v[first:last, BASE:] ** 2).sum() * t.tick)
    before, after = energy(t.tree, t.q[[first, last]], t.v[[first, last]], t.slope)
    steps = sum(first < row <= last for row, _ in t.strikes)
    return (work - damped - float(after - before)) / steps if steps else math.nan


def transport(t: Trajectory, sums: Sums) -> dict[str, float]:
    """The three costs of transport, torques and losses over the window.

    The thesis's c_mt matches |sum of joint powers|; the other two are what hardware pays.
    """
    w = sums.window
    rows = int(w["rows"])
    weight = float(t.tree.mass.sum()) * GRAVITY * travelled(sums) / t.tick
    return {
        "cost_of_transport": float(w["net"] / weight),
        "cost_of_transport_absolute": float(w["absolute"] / weight),
        "cost_of_transport_positive": float(w["positive"] / weight),
        "mean_torque": float(w["torque"].sum() / (rows * NU)),
        "peak_power": float(w["peak"]),
        "torque_rate": float(w["jumps"] / (rows - 1) * 1e-3 / t.tick),
        "saturation": float(w["saturated"] / rows),
        "contact_loss": float(-w["ground_power"] / rows),
    }


def per_joint(sums: Sums) -> dict[str, dict[str, float]]:
    """Peak and mean |torque| [N m] and peak |power| [W] of hip, knee and ankle over the window, both legs together."""
    w = sums.window
    return {
        name: {
            "peak_torque": float(w["torque_most"][i::SEGMENTS].max()),
            "mean_torque": float(w["torque"][i::SEGMENTS].sum() / (LEGS * int(w["rows"]))),
            "peak_power": float(w["power_most"][i::SEGMENTS].max()),
        }
        for i, name in enumerate(("hip", "knee", "ankle"))
    }
