"""What a file's actuators leave behind when those of a run take their place: rotors, and nothing that names them."""

from __future__ import annotations

import mujoco
import numpy as np

_ON_JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)


def replace_actuators(spec: mujoco.MjSpec) -> None:
    """Takes all actuators out of a completed file; their rotors' inertia and friction stay, at their joints.

    Those of a run are added in the order in which the law commands them. Sensors of actuators go with them, and of
    keyframes what they command: nothing reads either.

    Args:
        spec: The file, which is changed.
    """
    for actuator in list(spec.actuators):
        if actuator.trntype in _ON_JOINTS:
            joint, squared = spec.joint(actuator.target), float(actuator.gear[0]) ** 2
            if actuator.armature:
                joint.armature += squared * actuator.armature
            if np.any(actuator.damping):
                joint.damping = joint.damping + squared * np.asarray(actuator.damping)
        spec.delete(actuator)
    for sensor in list(spec.sensors):
        if mujoco.mjtObj.mjOBJ_ACTUATOR in (sensor.objtype, sensor.reftype):
            spec.delete(sensor)
    for part in list(spec.tuples):
        spec.delete(part)
    for key in spec.keys:
        key.ctrl = key.act = []
