"""The hanging leg in MuJoCo, from the robot's own model file: its torso fixed, joints that are held welded."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from biped.dynamics.mechanisms.leg import LINKS, Drive, Leg
from biped.robot.description import robot_at
from biped.robot.model import spec_of

SUBSTEPS = 4
"""Steps between samples: references are held over each, at their middle, which errs with the square of the step."""
_ABOVE = 2.0
"""[m] at which the torso is fixed, out of the ground's reach."""


def hanging(model: Path, leg: Leg, drive: Drive, locked: dict[int, float]) -> mujoco.MjModel:
    """The model file with its right leg alone, which hangs.

    Args:
        model: The model file.
        leg: What its joints have: inertia and damping of other gears than the file's.
        drive: Springs and dampers of its joints.
        locked: Joints that are held, and the angles [rad] they are held at.
    """
    spec, robot = spec_of(model), robot_at(model)
    right, left = robot.leg
    for parts in (spec.keys, spec.actuators, spec.pairs, spec.texts):
        for part in list(parts):
            spec.delete(part)
    spec.delete(spec.body(left.links[0]))
    for joint in robot.base.joints:
        spec.delete(spec.joint(joint))
    spec.body(robot.base.link).pos = [0.0, 0.0, _ABOVE]
    for j, (link, name) in enumerate(zip(right.links, right.joints, strict=True)):
        joint = spec.joint(name)
        if j in locked:
            turn = -0.5 * locked[j]  # about -y
            spec.body(link).quat = [np.cos(turn), 0.0, np.sin(turn), 0.0]
            spec.delete(joint)
            continue
        joint.armature = leg.armature[j]
        joint.damping = np.array([leg.damping[j] + drive.B[j], 0.0, 0.0])
        joint.stiffness = np.array([drive.K[j], 0.0, 0.0])
        joint.springref = 0.0
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    return spec.compile()


def in_mujoco(
    model: Path, leg: Leg, drive: Drive, locked: dict[int, float], start: np.ndarray, duration: float, sampling: float
) -> np.ndarray:
    """(n, 3) [rad] joint angles of the leg at the samples.

    Args:
        model: The model file.
        leg: See `hanging`.
        drive: Likewise.
        locked: Likewise.
        start: (3,) [rad] absolute angles at the start, at rest.
        duration: [s].
        sampling: [s].
    """
    compiled = hanging(model, leg, drive, locked)
    compiled.opt.timestep = step = sampling / SUBSTEPS
    data = mujoco.MjData(compiled)
    names = robot_at(model).leg[0].joints
    free = [j for j in range(LINKS) if j not in locked]
    at = [compiled.joint(names[j]).qposadr[0] for j in free]
    joint = np.append(start[0], np.diff(start))
    data.qpos[at] = joint[free]
    count = round(duration / sampling)
    out = np.tile(joint, (count + 1, 1))
    middle = (np.arange(count * SUBSTEPS) + 0.5) * step
    torque = (drive.K * drive.reference(middle))[:, free]
    for k in range(1, count + 1):
        for i in range((k - 1) * SUBSTEPS, k * SUBSTEPS):
            data.qfrc_applied[at] = torque[i]
            mujoco.mj_step(compiled, data)
        out[k, free] = data.qpos[at]
    return out
