"""The robot's leg that hangs on the bench, with its own gears or others: its numbers, and itself in MuJoCo.

Both are read from the robot's model file. In MuJoCo the torso is fixed and joints that are held are welded.
"""

from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.files import folder
from biped.dynamics.mechanisms.leg import LINKS, HangingLeg, MovingSprings

MODEL = folder("models") / "robot.xml"
"""The robot of chapter IV."""
BASE, ROOT = "torso", ("root_x", "root_z", "root_pitch")
BODIES = ("right_thigh", "right_shank", "right_foot")
HINGES = ("right_hip", "right_knee", "right_ankle")
OTHER = "left_thigh"
"""Names in its file: the torso with its joints, the leg that hangs, and the leg that is taken off."""

GEARS = (21.0, 12.0, 21.0)
"""Of hip, knee and ankle (Table 4.1)."""
HIGH = (105.0, 60.0, 105.0)
"""The usual highly geared joints of Fig 4.7, dotted."""
FRICTION = 4.1e-3
"""[N m] of the motor's brushes and bearings: its no-load current of 0.137 A times 30.2 mN m/A."""
STEP = 1.0 / 600.0
"""[s] between samples, of which the periods of Fig 4.8 are whole numbers."""
SUBSTEPS = 4
"""Steps of MuJoCo between samples: references are held over each, at their middle, which errs with its square."""
_ABOVE = 2.0
"""[m] at which the torso is fixed, out of the ground's reach."""


class Reading(NamedTuple):
    """A way to read what a gear does to a joint.

    Attributes:
        name: In words.
        gears: Of hip, knee and ankle.
        squared: Whether damping grows with the square of the gear, as friction on the motor's side does; else it is
            the joint's own, whatever the gear.
        coulomb: Whether the motors' dry friction acts.
    """

    name: str
    gears: tuple[float, float, float]
    squared: bool = False
    coulomb: bool = False


READINGS = (
    Reading("21/12, as built", GEARS),
    Reading("21/12, dry friction of the motors too", GEARS, coulomb=True),
    Reading("105/60, damping of the joint", HIGH),
    Reading("105/60, damping with n²", HIGH, squared=True),
)


def leg_of(model: Path, reading: Reading = READINGS[0]) -> HangingLeg:
    """Reads the right leg out of the model file and gives it other gears than its own."""
    compiled = mujoco.MjModel.from_xml_path(str(model))
    bodies = [compiled.body(name).id for name in BODIES]
    dofs = [compiled.joint(name).dofadr[0] for name in HINGES]
    ratio = (np.array(reading.gears) / GEARS) ** 2
    hinge = np.zeros((LINKS, 2))
    hinge[:2] = compiled.body_pos[bodies[1:]][:, [0, 2]]
    return HangingLeg(
        mass=compiled.body_mass[bodies],
        inertia=compiled.body_inertia[bodies, 1],
        com=compiled.body_ipos[bodies][:, [0, 2]],
        joint=hinge,
        armature=compiled.dof_armature[dofs] * ratio,
        damping=compiled.dof_damping[dofs] * (ratio if reading.squared else 1.0),
        coulomb=FRICTION * np.array(reading.gears) * (1.0 if reading.coulomb else 0.0),
    )


def relative(q: np.ndarray) -> np.ndarray:
    """(n, 3) [rad] joint angles of absolute ones q (n, 3)."""
    return np.column_stack([q[:, 0], np.diff(q, axis=1)])


def hanging(model: Path, leg: HangingLeg, drive: MovingSprings, locked: dict[int, float]) -> mujoco.MjModel:
    """The model file with its right leg alone, which hangs.

    Args:
        model: The model file.
        leg: Inertia and damping of its joints: those of other gears than the file's.
        drive: Springs and dampers of its joints.
        locked: Joints that are held, and the angles [rad] they are held at.
    """
    spec = mujoco.MjSpec.from_file(str(model))
    for parts in (spec.keys, spec.actuators, spec.pairs, spec.texts):
        for part in list(parts):
            spec.delete(part)
    spec.delete(spec.body(OTHER))
    for joint in ROOT:
        spec.delete(spec.joint(joint))
    spec.body(BASE).pos = [0.0, 0.0, _ABOVE]
    for j, (link, name) in enumerate(zip(BODIES, HINGES, strict=True)):
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
    model: Path,
    leg: HangingLeg,
    drive: MovingSprings,
    locked: dict[int, float],
    start: np.ndarray,
    duration: float,
    sampling: float,
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
    free = [j for j in range(LINKS) if j not in locked]
    at = [compiled.joint(HINGES[j]).qposadr[0] for j in free]
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
