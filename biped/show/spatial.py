"""What is drawn of any run in space: a planar robot's is lifted out of its plane, others are as they are.

Everything is in the frame of the ground, in which gravity leans on a slope.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from biped.measure.pushes import Shown, pushes_of
from biped.measure.signals import centre_of_mass
from biped.measure.trajectory import Trajectory
from biped.robot.ground import box_of
from biped.robot.planar.topology import THIGH
from biped.robot.planar.tree import motion

if TYPE_CHECKING:
    from biped.measure.stored import AnyTrajectory


def lift(planar: np.ndarray) -> np.ndarray:
    """(…, 3) of (…, 2): (x, z) becomes (x, 0, z)."""
    return np.stack([planar[..., 0], np.zeros(planar.shape[:-1]), planar[..., 1]], axis=-1)


def mass(t: AnyTrajectory) -> float:
    """[kg] of the whole robot."""
    return float(t.tree.mass.sum()) if isinstance(t, Trajectory) else t.robot.mass


def centre(t: AnyTrajectory) -> np.ndarray:
    """(n, 3) [m] centre of mass of the whole robot."""
    return lift(centre_of_mass(t)) if isinstance(t, Trajectory) else t.com


def points(t: AnyTrajectory, row: int) -> np.ndarray:
    """(P, 3) [m] contact points in a row."""
    if not isinstance(t, Trajectory):
        return t.point[row]
    return lift(motion(t.tree, t.q[row : row + 1], t.v[row : row + 1]).point[0])


def forces(t: AnyTrajectory) -> np.ndarray:
    """(n, P, 3) [N] of the ground on the contact points."""
    return lift(t.force) if isinstance(t, Trajectory) else t.force


def plumb(t: AnyTrajectory) -> np.ndarray:
    """(3,) what is above a point of the ground by a metre along its normal, straight up from it."""
    if isinstance(t, Trajectory):
        return np.array([math.tan(math.radians(t.slope)), 0.0, 1.0])
    return np.array(t.gravity) / t.gravity[2]


def tilt(t: AnyTrajectory) -> np.ndarray:
    """(3, 3) from the ground's frame to the world's, in which gravity is vertical."""
    from biped.robot.build import frame

    return frame(t.slope, 0.0 if isinstance(t, Trajectory) else t.side_slope).T


def seat(t: AnyTrajectory) -> tuple[np.ndarray, np.ndarray] | None:
    """Middle (3,) and half sides (3,) [m] of what a run can sit on; None if there is nothing."""
    return box_of(t.seat) if isinstance(t, Trajectory) and t.seat is not None else None


def seated(t: AnyTrajectory, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the seat bears the pelvis (m, 1, 3) [m], in rows (m,), and its force (n, 1, 3) [N]; none without a seat."""
    if not isinstance(t, Trajectory) or t.seat is None or t.seat_force is None:
        return np.empty((len(rows), 0, 3)), np.empty((len(t), 0, 3))
    place = lift(motion(t.tree, t.q[rows], t.v[rows]).joint[:, THIGH[0] : THIGH[0] + 1])
    place[..., 2] -= t.seat.pelvis
    return place, lift(t.seat_force[:, None, :2])


def pushes(t: AnyTrajectory) -> list[Shown]:
    """Pushes with forces (k, 3) [N] in the ground's frame."""
    turn = tilt(t)
    return [push._replace(force=(lift(push.force) if push.force.shape[1] == 2 else push.force) @ turn)
            for push in pushes_of(t)]  # fmt: skip
