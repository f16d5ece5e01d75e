"""Joints of a robot that are taken out of its model file: what hung on them is stiff, as the robot's start has it."""

from collections.abc import Sequence

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.scenario.robot import Described

_HINGES = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
_CLOSE = 1e-9
"""[m] by which a body may be elsewhere afterwards."""


def stiffen(spec: mujoco.MjSpec, table: Described) -> None:
    """Takes joints out of a completed file, with their actuators.

    Args:
        spec: The file, which is changed.
        table: What is said of the robot: which joints, and its start.

    Raises:
        InputError: A joint is not there or no hinge, or something else of the file needs it.
    """
    joints = {joint.name: joint for joint in spec.joints}
    for name in table.rigid:
        if name not in joints:
            raise InputError(f"robot.rigid: no joint '{name}'; {nearest(name, list(joints))}", "robot.rigid")
        if joints[name].type not in _HINGES:
            raise InputError(f"robot.rigid: joint '{name}': expected a hinge or a slide", "robot.rigid")
    model = spec.compile()
    data = mujoco.MjData(model)
    keys = [model.key(i).name for i in range(model.nkey)]
    if keys:
        mujoco.mj_resetDataKeyframe(model, data, keys.index(table.start) if table.start in keys else 0)
    mujoco.mj_kinematics(model, data)
    for name in table.rigid:
        _place(spec, model, data, int(model.jnt_bodyid[model.joint(name).id]))
    for actuator in list(spec.actuators):
        if actuator.target in table.rigid:
            spec.delete(actuator)
    for sensor in list(spec.sensors):
        if sensor.objname in table.rigid or sensor.objtype == mujoco.mjtObj.mjOBJ_ACTUATOR:
            spec.delete(sensor)
    for name in table.rigid:
        spec.delete(joints[name])
    _cut_keyframes(spec, model, table.rigid)
    _compare(spec, model, data)


def _place(spec: mujoco.MjSpec, model: mujoco.MjModel, data: mujoco.MjData, body: int) -> None:
    """Puts a body where it is in its parent's frame."""
    parent = int(model.body_parentid[body])
    turn = data.xmat[parent].reshape(3, 3)
    back, quat = np.empty(4), np.empty(4)
    mujoco.mju_negQuat(back, data.xquat[parent])
    mujoco.mju_mulQuat(quat, back, data.xquat[body])
    part = spec.body(model.body(body).name)
    part.pos, part.quat = turn.T @ (data.xpos[body] - data.xpos[parent]), quat
    part.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT


def _cut_keyframes(spec: mujoco.MjSpec, model: mujoco.MjModel, names: Sequence[str]) -> None:
    """Takes joints out of all keyframes, and what these command."""
    numbers = [model.joint(name).id for name in names]
    for number, key in enumerate(spec.keys):
        key.qpos = np.delete(model.key_qpos[number], model.jnt_qposadr[numbers])
        key.qvel = np.delete(model.key_qvel[number], model.jnt_dofadr[numbers])
        key.ctrl = key.act = []


def _compare(spec: mujoco.MjSpec, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Makes sure that all bodies are where they were.

    Raises:
        InputError: One is not, or something of the file needs a joint that is gone.
    """
    try:
        stiff = spec.compile()
    except ValueError as error:
        raise InputError(f"robot.rigid: {' '.join(str(error).split())}", "robot.rigid") from None
    there = mujoco.MjData(stiff)
    names = {model.joint(j).name: j for j in range(model.njnt)}
    for joint in range(stiff.njnt):
        old = names[stiff.joint(joint).name]
        size = 7 if model.jnt_type[old] == mujoco.mjtJoint.mjJNT_FREE else 1
        first = int(model.jnt_qposadr[old])
        there.qpos[int(stiff.jnt_qposadr[joint]) :][:size] = data.qpos[first : first + size]
    mujoco.mj_kinematics(stiff, there)
    for body in range(model.nbody):
        name = model.body(body).name
        if np.abs(there.xpos[stiff.body(name).id] - data.xpos[body]).max() > _CLOSE:
            raise InputError(f"robot.rigid: body '{name}' cannot be held where the start has it", "robot.rigid")
