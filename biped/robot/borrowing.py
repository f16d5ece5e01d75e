"""Postures of the human in space that another biped takes over.

Torso and thighs are turned as the human's are, knees and ankles bent as far, within the ranges of the joints; rates are
multiplied by the root of the ratio of leg lengths, and the base moves so that the foot that stands moves as the human's
does.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.files import locate
from biped.robot.anatomy import HIP, JOINTS, Anatomy, JointedLeg, anatomy_of
from biped.robot.recognise import robot_of
from biped.robot.robot import Robot
from biped.robot.spec import parsed
from biped.scenario.robot import Described, Foot

_STEPS = 50
_CLOSE = 1e-10
_NEAR_END = 0.02
"""[rad] from the end of a joint's range at which it starts at the most."""


class _Walker(NamedTuple):
    """A biped in a state.

    Attributes:
        model: Of it.
        data: Its state, with kinematics and velocities.
        anatomy: What is what in it.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    anatomy: Anatomy


@lru_cache(maxsize=1)
def _human() -> tuple[mujoco.MjModel, Robot]:
    path = locate("models", "human3d", "model")
    feet = tuple(Foot(name, tuple(f"{name}_{end}_{side}" for end in ("toe", "heel") for side in ("inner", "outer")))
                 for name in ("right", "left"))  # fmt: skip
    table = Described(foot=feet)
    return parsed(path, table)[1], robot_of(path, table)


def borrowed_names() -> tuple[str, ...]:
    """Postures that a biped in space may take over."""
    return _human()[1].starts


def borrow(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, name: str) -> None:
    """Puts a biped into a posture of the human's.

    Args:
        model: Of the biped.
        data: Its state, at its own start; changed in place.
        robot: What it is.
        name: The posture.

    Raises:
        InputError: Its legs are of another kind.
    """
    human, who = _human()
    theirs = mujoco.MjData(human)
    mujoco.mj_resetDataKeyframe(human, theirs, who.starts.index(name))
    _computed(human, theirs)
    teacher = _Walker(human, theirs, anatomy_of(human, who))
    pupil = _Walker(model, data, anatomy_of(model, robot))
    pace = math.sqrt(teacher.anatomy.leg / pupil.anatomy.leg)
    base, their_base = robot.base_number, who.base_number
    data.qvel[:] = 0.0
    turned = _axes(theirs, their_base, teacher.anatomy.axes)
    spin = pace * _spin(human, theirs, their_base)
    if robot.planar:
        pitch = [int(model.dof_jntid[robot.pitch_column])]
        _turn(pupil, pitch, base, pupil.anatomy.axes, turned)
        data.qvel[robot.pitch_column] = data.xaxis[pitch[0]] @ spin
    else:
        first, column = int(model.jnt_qposadr[model.body_jntadr[base]]), robot.base_columns[0]
        turn = turned @ pupil.anatomy.axes.T
        mujoco.mju_mat2Quat(data.qpos[first + 3 : first + 7], turn.ravel())
        data.qvel[column + 3 : column + 6] = turn.T @ spin
    for mine, other in zip(pupil.anatomy.legs, teacher.anatomy.legs, strict=True):
        _bend(pupil, mine, teacher, other)
        _turn(pupil, mine.hips, mine.thigh, mine.axes, _axes(theirs, other.thigh, other.axes))
    _computed(model, data)
    for mine, other in zip(pupil.anatomy.legs, teacher.anatomy.legs, strict=True):
        wanted = pace * _spin(human, theirs, other.thigh) - _spin(model, data, base)
        axes = data.xaxis[mine.hips]
        rates = axes @ wanted if robot.planar else np.linalg.solve(axes.T, wanted)
        data.qvel[model.jnt_dofadr[mine.hips]] = rates
        for i in range(HIP, JOINTS):
            joint = mine.joints[i]
            if joint >= 0:
                rate = theirs.qvel[human.jnt_dofadr[other.joints[i]]] * other.sign[i]
                data.qvel[model.jnt_dofadr[joint]] = pace * mine.sign[i] * rate
    _computed(model, data)
    low = [_sole(walker)[:, :, 2].mean(axis=1) for walker in (teacher, pupil)]
    stands = int(np.argmin(low[0]))
    theirs_moves, mine_moves = (_moving(walker, stands) for walker in (teacher, pupil))
    along = theirs_moves / pace - mine_moves
    data.qvel[list(robot.moving_columns)] = along[::2] if robot.planar else along


def _bend(pupil: _Walker, mine: JointedLeg, teacher: _Walker, other: JointedLeg) -> None:
    """Bends knee and ankle as far as the human's."""
    for i in range(HIP, JOINTS):
        joint = mine.joints[i]
        if joint < 0:
            continue
        theirs = teacher.data.qpos[teacher.model.jnt_qposadr[other.joints[i]]]
        angle = other.sign[i] * (theirs - other.zero[i])
        value = mine.zero[i] + mine.sign[i] * angle
        pupil.data.qpos[pupil.model.jnt_qposadr[joint]] = _within(pupil.model, joint, float(value))


def _within(model: mujoco.MjModel, joint: int, value: float) -> float:
    """A coordinate, or the next one within its joint's range."""
    if not model.jnt_limited[joint]:
        return value
    low, high = model.jnt_range[joint]
    return min(max(value, float(low) + _NEAR_END), float(high) - _NEAR_END)


def _turn(walker: _Walker, joints: list[int], body: int, own: np.ndarray, wanted: np.ndarray) -> None:
    """Turns joints until a body's own axes are as wanted, or as near as its joints allow (Gauss-Newton)."""
    model, data = walker.model, walker.data
    for _ in range(_STEPS):
        mujoco.mj_kinematics(model, data)
        rest = wanted @ _axes(data, body, own).T
        quat, away = np.empty(4), np.empty(3)
        mujoco.mju_mat2Quat(quat, rest.ravel())
        mujoco.mju_quat2Vel(away, quat, 1.0)
        step = np.linalg.lstsq(data.xaxis[joints].T, away, rcond=1e-3)[0]
        data.qpos[model.jnt_qposadr[joints]] += np.clip(step, -0.5, 0.5)
        if np.abs(step).max() < _CLOSE:
            break
    for joint in joints:
        place = model.jnt_qposadr[joint]
        data.qpos[place] = _within(model, joint, float(data.qpos[place]))


def _axes(data: mujoco.MjData, body: int, own: np.ndarray) -> np.ndarray:
    """(3, 3) a body's own axes in the world, as columns."""
    return data.xmat[body].reshape(3, 3) @ own


def _computed(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_comVel(model, data)


def _spin(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> np.ndarray:
    """(3,) [rad/s] angular velocity of a body in the world."""
    out = np.empty(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, out, 0)
    return out[:3]


def _sole(walker: _Walker) -> np.ndarray:
    """(2, 4, 3) [m] corners of the soles."""
    data = walker.data
    return np.array([data.xpos[leg.foot] + leg.sole @ data.xmat[leg.foot].reshape(3, 3).T
                     for leg in walker.anatomy.legs])  # fmt: skip


def _moving(walker: _Walker, side: int) -> np.ndarray:
    """(3,) [m/s] of the middle of a sole."""
    model, data, leg = walker.model, walker.data, walker.anatomy.legs[side]
    J = np.empty((3, model.nv))
    mujoco.mj_jac(model, data, J, None, _sole(walker)[side].mean(axis=0), leg.foot)
    return J @ data.qvel
