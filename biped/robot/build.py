"""The model that MuJoCo steps in a run: this ground, this solver, these limits, actuators as the law commands them."""

from functools import lru_cache
from pathlib import Path
from typing import Literal, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.robot.base import other_planes
from biped.robot.gravity import gravity3
from biped.robot.ground import is_level, levelled
from biped.robot.recognise import robot_of
from biped.robot.robot import Drive, Robot, torque_limits
from biped.robot.spec import read, set_solver
from biped.robot.truth import apply_truth
from biped.robot.uneven import give_planes, name_geoms, pairs_with_planes
from biped.scenario.general import FILE
from biped.scenario.keys import Scenario, Simulation, Truth
from biped.scenario.robot import Described
from biped.scenario.world import Ground

Command = Literal["torque", "position", "velocity", "generalized"]
"""Commands that a law returns: torques [N m] or targets [rad, rad/s] of servos at joints, or forces of velocities."""

_OVERRIDE = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
"""Flag that lets a file's options decide on contacts."""

_ON_JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)


class Servo(NamedTuple):
    """A servo that a law brings along for a joint.

    Attributes:
        stiffness: [N m/rad].
        damping: [N m s/rad].
        effort: [N m] bound of its torque besides the joint's own.
    """

    stiffness: float
    damping: float
    effort: float


def compiled(
    path: Path, s: Scenario, command: Command, servos: tuple[Servo | None, ...] | None = None
) -> mujoco.MjModel:
    """The model of a run; runs that differ in nothing of it share one, which is not to be written to.

    Args:
        path: The file.
        s: The scenario.
        command: What its law commands.
        servos: Of the law, one for each actuator, where it brings any: None is the file's own.

    Raises:
        InputError: The file is no robot, or has no servos where the law commands them.
    """
    assert s.robot is not None
    robot = robot_of(path, s.robot)
    for key in ("servo_stiffness", "servo_damping"):
        if getattr(s.truth, key) != 1.0 and command not in ("position", "velocity"):
            raise InputError(f"truth.{key}: expected 1: the law commands {command}, and no servo acts", f"truth.{key}")
    limits = torque_limits(robot, s)
    level = is_level(s.ground)
    # Heights along the way are no part of the model: only that there are any.
    return _compiled(str(path), path.stat().st_mtime, s.robot, levelled(s.ground), level, s.simulation, s.truth, limits,
                     command, servos or (None,) * len(limits))  # fmt: skip


@lru_cache(maxsize=8)
def _compiled(
    file: str, modified: float, table: Described, ground: Ground, level: bool, simulation: Simulation, truth: Truth,
    limits: tuple[float, ...], command: Command, servos: tuple[Servo | None, ...],
) -> mujoco.MjModel:  # fmt: skip
    path = Path(file)
    robot = robot_of(path, table)
    spec = read(path, table)
    _replace_actuators(spec)
    if truth != Truth():
        apply_truth(spec, truth, robot)
    if not level:
        name_geoms(spec)
        give_planes(spec, robot)
    for drive, limit, servo in zip(robot.drives, limits, servos, strict=True) if command != "generalized" else ():
        _drive(spec, drive, limit, command, servo, truth)
    option = spec.option
    option.solver, option.disableactuator = getattr(mujoco.mjtSolver, f"mjSOL_{simulation.solver.upper()}"), 0
    if simulation.physics != FILE:
        option.noslip_iterations, option.enableflags = 0, option.enableflags & ~_OVERRIDE
    set_solver(option, simulation)
    option.gravity = gravity3(ground.slope, ground.side_slope)
    option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    model = spec.compile()
    _lay(model, robot, ground, level)
    return model


def _drive(
    spec: mujoco.MjSpec, drive: Drive, limit: float, command: Command, servo: Servo | None, truth: Truth
) -> None:
    """Adds an actuator that is what the law commands, in units of its joint; torques have their strength already."""
    actuator = spec.add_actuator(name=drive.name, target=drive.joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.gear = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    stiffer, damped = truth.strength * truth.servo_stiffness, truth.strength * truth.servo_damping
    if command == "torque":
        actuator.set_to_motor()
    elif command == "position" and servo is not None:
        actuator.set_to_position(kp=stiffer * servo.stiffness, kv=damped * servo.damping)
        limit = min(limit, servo.effort)
    elif command == "position":
        _needs(drive, drive.stiffness, "stiffness")
        actuator.set_to_position(kp=stiffer * drive.stiffness, kv=damped * drive.damping)
    else:
        _needs(drive, drive.damping, "damping")
        actuator.set_to_velocity(kv=damped * drive.damping)
    actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_FALSE
    if command == "position" and servo is None and drive.span is not None:
        actuator.ctrllimited, actuator.ctrlrange = mujoco.mjtLimited.mjLIMITED_TRUE, list(drive.span)
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    actuator.forcerange = [-truth.strength * limit, truth.strength * limit]


def _needs(drive: Drive, value: float, key: str) -> None:
    if value <= 0.0:
        raise InputError(
            f"law: commands servos, but actuator '{drive.name}' is one of {drive.kind}; write [robot.actuators] "
            f"{key} = "
            "that of a servo at its joint", "law",
        )  # fmt: skip


def _lay(model: mujoco.MjModel, robot: Robot, ground: Ground, level: bool) -> None:
    """Gives contacts with the ground the scenario's friction and stiffness, whatever the parts of the robot say.

    What the scenario leaves to the file stays the ground's own: of its geom, not of the parts that touch it.
    """
    friction = None if ground.friction is None else max(ground.friction, 1e-5)
    solref = [(0, ground.contact_time), (1, ground.damping_ratio)]
    laid, g = pairs_with_planes(model), robot.ground
    if level:
        model.geom_contype[other_planes(model, g)] = model.geom_conaffinity[other_planes(model, g)] = 0
        if friction is None and all(value is None for _, value in solref):
            return
        model.geom_priority[g] = int(model.geom_priority.max()) + 1
        model.geom_condim[g] = max(3, int(model.geom_condim[g]))
        laid = [i for i in range(model.npair) if g in (model.pair_geom1[i], model.pair_geom2[i])]
        model.geom_friction[g, 0] = model.geom_friction[g, 0] if friction is None else friction
    if friction is not None:
        model.pair_friction[laid, :2] = friction
    for i, value in solref:
        if value is not None:
            model.geom_solref[g, i] = value if level else model.geom_solref[g, i]
            model.pair_solref[laid, i] = value


def _replace_actuators(spec: mujoco.MjSpec) -> None:
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
