"""The true robot, where it differs from the model file that its law knows: masses, inertias, damping."""

import mujoco
import numpy as np
from msgspec import structs

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.robot.planar.tree import check_solid, true_tree
from biped.robot.robot import Robot, with_tree
from biped.scenario.keys import Truth

_HINGE = mujoco.mjtJoint.mjJNT_HINGE


def apply_truth(spec: mujoco.MjSpec, truth: Truth, robot: Robot) -> None:
    """Changes a completed file to what is true of the robot.

    Args:
        spec: The file, which is changed.
        truth: Of the scenario.
        robot: What the file says.
    """
    model = spec.compile()
    bodies = {one.name: one for one in truth.part}
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for number in range(1, model.nbody):
        body, true = spec.body(model.body(number).name), bodies.get(model.body(number).name)
        mass, inertia, shift = (1.0, 1.0, np.zeros(3)) if true is None else (true.mass, true.inertia, true.shift)
        body.explicitinertial = True
        body.fullinertia = [np.nan, 0.0, 0.0, 0.0, 0.0, 0.0]  # a URDF's: said along its own axes from here on
        body.mass = mass * model.body_mass[number]
        body.inertia = mass * inertia * model.body_inertia[number]
        body.ipos = model.body_ipos[number] + np.array(shift)
        body.iquat = model.body_iquat[number]
    base = spec.body(robot.base)
    for joint in spec.joints:
        if joint.type == _HINGE and joint.parent.name != base.name:
            # MuJoCo 4 keeps a polynomial in the rate: linear, quadratic and cubic coefficient.
            joint.damping = truth.joint_losses * (joint.damping + np.array([truth.joint_damping, 0.0, 0.0]))
            joint.frictionloss = truth.joint_losses * (joint.frictionloss + truth.joint_friction)
            joint.armature += truth.armature


def check_truth(truth: Truth, robot: Robot) -> None:
    """Makes sure that a truth is one of the robot: bodies are its own, each named once, and none is too light.

    Raises:
        InputError: It is not.
    """
    if truth != Truth() and robot.seven_links is not None:
        check_solid(truth, robot.seven_links, robot.seven_links.tree)
    seen = set()
    for i, one in enumerate(truth.part):
        if one.name not in robot.bodies:
            raise InputError(
                f"truth.part[{i}].name: model '{robot.name}' has no body '{one.name}'; "
                f"{nearest(one.name, list(robot.bodies))}", f"truth.part[{i}].name",
            )  # fmt: skip
        if one.name in seen:
            raise InputError(f"truth.part[{i}].name: '{one.name}' is named twice", f"truth.part[{i}].name")
        seen.add(one.name)


def true_robot(truth: Truth, robot: Robot) -> Robot:
    """Returns the robot that walks, given that of the model file; of other than seven links its masses are true."""
    if truth == Truth():
        return robot
    if robot.seven_links is not None:
        return with_tree(robot, true_tree(robot.seven_links.tree, truth))
    factors = {one.name: one.mass for one in truth.part}
    masses = (mass * factors.get(name, 1.0) for name, mass in zip(robot.bodies, robot.masses, strict=True))
    return structs.replace(robot, masses=tuple(masses))
