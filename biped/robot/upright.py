"""A posture of level ground stands up on a slope: its body is as upright as there, and its feet are where they were."""

import math

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.robot.parts import base_places, contact_points
from biped.robot.robot import Robot

_MOST_CHANGES = 100
_STEADY = 1e-9
"""[m, rad] change with which the search ends."""
_STIFFNESS = 1e-3
"""[m²/rad²] What turning a joint costs beside points that are elsewhere: it chooses among postures that fit alike."""
_TRAVEL, _LIFT = 1.0, 1e-2
"""The same for the place of the base, along level ground and up."""
_FURTHEST = 0.03
"""[m] A point that stays further from its place than this makes another posture."""


def stand_upright(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, frame: np.ndarray) -> None:
    """Turns the base to where gravity says, about the middle of the feet, and bends legs until feet are as before.

    Args:
        model: Of the robot.
        data: A posture of level ground; changed in place.
        robot: What it is.
        frame: (3, 3) from the world, whose z is up, to the ground's frame.

    Raises:
        InputError: The legs cannot reach.
    """
    mujoco.mj_kinematics(model, data)
    wanted = contact_points(data, robot)
    middle = wanted.mean(axis=0)
    middle[2] = wanted[:, 2].min()
    if robot.planar:
        pitch = int(model.dof_jntid[robot.pitch_column])
        axis, place = data.xaxis[pitch], data.xanchor[pitch]
        data.qpos[base_places(model, robot)] += (middle + frame @ (place - middle) - place)[::2]
        data.qpos[model.jnt_qposadr[pitch]] += axis[1] * math.atan2(frame[0, 2], frame[0, 0])
    else:
        first = int(model.jnt_qposadr[model.body_jntadr[robot.base_number]])
        data.qpos[first : first + 3] = middle + frame @ (data.qpos[first : first + 3] - middle)
        turn, out = np.empty(4), np.empty(4)
        mujoco.mju_mat2Quat(turn, frame.ravel())
        mujoco.mju_mulQuat(out, turn, data.qpos[first + 3 : first + 7])
        data.qpos[first + 3 : first + 7] = out
    _reach(model, data, robot, wanted, frame[:, 2])
    if float(np.linalg.norm(contact_points(data, robot) - wanted, axis=1).max()) > _FURTHEST:
        raise InputError(
            "start.upright: the legs cannot reach the slope with the body upright; expected a gentler slope, or false",
            "start.upright",
        )


def _reach(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, wanted: np.ndarray, up: np.ndarray) -> None:
    """Least squares in the legs' joints and the base's place (Gauss-Newton), within the joints' ranges."""
    bodies = [body for foot in robot.feet for body in foot.on]
    base, own = base_places(model, robot), {int(joint) for joint in model.dof_jntid[list(robot.base_columns)]}
    n = len(base)
    joints = [j for j in range(model.njnt) if j not in own and model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE]
    places, columns = model.jnt_qposadr[joints], [*robot.moving_columns, *model.jnt_dofadr[joints]]
    limited = np.r_[np.zeros(n, bool), model.jnt_limited[joints] > 0]
    low, high = (np.r_[np.zeros(n), end] for end in model.jnt_range[joints].T)
    cost = np.diag(np.full(len(columns), _STIFFNESS))
    travel = _TRAVEL * (np.eye(3) - np.outer(up, up)) + _LIFT * np.outer(up, up)
    cost[:n, :n] = travel[::2, ::2] if robot.planar else travel
    start, rows = np.r_[data.qpos[base], data.qpos[places]], np.empty((3, model.nv))
    at = start.copy()
    for _ in range(_MOST_CHANGES):
        data.qpos[base], data.qpos[places] = at[:n], at[n:]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        now = contact_points(data, robot)
        J = np.empty((len(now), 3, len(columns)))
        for p, (point, body) in enumerate(zip(now, bodies, strict=True)):
            mujoco.mj_jac(model, data, rows, None, point, body)
            J[p] = rows[:, columns]
        J = J.reshape(-1, len(columns))
        H, f = J.T @ J + cost, J.T @ (wanted - now).ravel() - cost @ (at - start)
        # What is at the end of its range and wants beyond stays there.
        free = ~(limited & (((at <= low) & (f < 0.0)) | ((at >= high) & (f > 0.0))))
        step = np.zeros(len(columns))
        step[free] = np.linalg.solve(H[np.ix_(free, free)], f[free])
        after = np.where(limited, np.clip(at + step, low, high), at + step)
        steady = float(np.abs(after - at).max()) < _STEADY
        at = after
        if steady:
            break
