"""Drawing of any run in space: a planar robot's is lifted out of its plane, others are as they are.

Everything is in the frame of the ground, in which gravity leans on a slope.
"""

import mujoco
import numpy as np

from biped.measure.pushes import PushInterval, pushes_of
from biped.measure.trajectory import Trajectory
from biped.robot.ground import box_of, frame
from biped.robot.planar.topology import THIGH
from biped.robot.planar.tree import motion


def lift(planar: np.ndarray) -> np.ndarray:
    """(…, 3) of (…, 2): (x, z) becomes (x, 0, z)."""
    return np.stack([planar[..., 0], np.zeros(planar.shape[:-1]), planar[..., 1]], axis=-1)


def beside(t: Trajectory, way: float) -> float:
    """[m] by which what is drawn of a run stands aside: `way` in the plane, where limbs hide it, otherwise 0."""
    return way if t.robot.planar else 0.0


def plumb(t: Trajectory) -> np.ndarray:
    """(3,) what is above a point of the ground by a metre along its normal, straight up from it."""
    return np.array(t.gravity) / t.gravity[2]


def tilt(t: Trajectory) -> np.ndarray:
    """(3, 3) from the ground's frame to the world's, in which gravity is vertical."""
    return frame(t.slope, t.side_slope).T


def seat(t: Trajectory) -> tuple[np.ndarray, np.ndarray] | None:
    """Middle (3,) and half sides (3,) [m] of what a run can sit on; None if there is nothing."""
    return None if t.seat is None else box_of(t.seat)


def seated(t: Trajectory, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the seat bears the pelvis (m, 1, 3) [m], in rows (m,), and its force (n, 1, 3) [N]; none without a seat."""
    if t.seat is None or t.seat_force is None:
        return np.empty((len(rows), 0, 3)), np.empty((len(t), 0, 3))
    place = lift(motion(t.tree, t.q[rows], t.v[rows]).joint[:, THIGH[0] : THIGH[0] + 1])
    place[..., 2] -= t.seat.pelvis
    return place, lift(t.seat_force[:, None, :2])


def pushes(t: Trajectory) -> list[PushInterval]:
    """Pushes with forces (k, 3) [N] in the ground's frame."""
    turn = tilt(t)
    return [push._replace(force=push.force @ turn) for push in pushes_of(t)]


def light_evenly(model: mujoco.MjModel) -> None:
    """Lights a model from the camera and, dimly, by its own lamps as if far away: one at the start is soon left behind.

    Args:
        model: A compiled model, changed in what is for looking only.
    """
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.45, 0.5
    model.light_type[:] = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL.value
    model.light_diffuse[:] = 0.15
