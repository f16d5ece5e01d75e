"""The model that MuJoCo steps in a run: this ground, level or not, this solver, these limits, actuators as commanded.

On ground that is not level every part of a robot that may touch it gets a plane of its own. A foot of boxes, cylinders
or meshes touches at its contact points, and where it is a capsule at that one's two ends; any other part as it is, with
the plane below its middle. Planes are laid along the line of the ground before every step (`biped.engines.uneven`).
"""

from functools import lru_cache
from pathlib import Path
from typing import Literal, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.robot.ground import gravity3, is_level, levelled
from biped.robot.parts import other_planes, pairs_of, touches
from biped.robot.planar.build import plane_below
from biped.robot.recognise import robot_of
from biped.robot.robot import Drive, Robot, torque_limits
from biped.robot.spec import read, set_solver
from biped.robot.truth import apply_truth
from biped.scenario.general import FILE
from biped.scenario.keys import Scenario, Simulation, Truth
from biped.scenario.robot import Described
from biped.scenario.world import Ground

_POINT = 1e-6
"""[m] radius of the spheres that stand for points."""
_LAST_GROUP = 5
"""Geoms of which nobody sees."""
_EDGED = (mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_MESH)
_PLANE, _SPHERE = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_SPHERE


class _Ball(NamedTuple):
    """A sphere that touches for a part: its body, place there [m] and radius [m]."""

    body: int
    place: tuple[float, ...]
    radius: float


def give_planes(spec: mujoco.MjSpec, robot: Robot) -> None:
    """Adds the planes and the pairs that meet, and takes the level plane out of contact; nobody sees any of it.

    Args:
        spec: The completed file, with the names that `name_geoms` gave; changed.
        robot: What it is.
    """
    model = spec.compile()
    pairs = pairs_of(model)
    own = {i: (int(model.pair_geom1[i]), int(model.pair_geom2[i])) for i in range(model.npair)}
    of_file = {(set(both) - {robot.ground}).pop(): i for i, both in own.items() if robot.ground in both}
    feet = {geom for foot in robot.feet for geom in foot.geoms}
    touching = [g for g in range(model.ngeom)
                if model.geom_bodyid[g] > 0 and touches(model, pairs, g, robot.ground)]  # fmt: skip
    parts = [model.geom(g).name for g in touching if g not in feet]
    sizes = [int(model.pair_dim[of_file[g]]) if g in of_file else int(model.geom_condim[robot.ground])
             for g in touching]  # fmt: skip
    for foot in robot.feet:
        edged = any(model.geom_type[g] in _EDGED for g in foot.geoms)
        balls = [_Ball(body, place, _POINT) for body, place in zip(foot.on, foot.points, strict=True)] if edged else []
        for geom in () if edged else foot.geoms:
            if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
                balls += _ends(model, geom)
            else:
                parts.append(model.geom(geom).name)
        for number, ball in enumerate(balls):
            name = f"{foot.name}, point {number}"
            spec.body(model.body(ball.body).name).add_geom(
                name=name, type=_SPHERE, size=[ball.radius, 0.0, 0.0], pos=list(ball.place), mass=0.0, contype=0,
                conaffinity=0, group=_LAST_GROUP,
            )  # fmt: skip
            parts.append(name)
    level = model.geom(robot.ground).name
    for pair in [pair for pair in spec.pairs if level in (pair.geomname1, pair.geomname2)]:
        spec.delete(pair)
    for part in parts:
        plane = spec.worldbody.add_geom(name=plane_below(part), type=_PLANE, size=[0.0, 0.0, 0.05], contype=0,
                                        conaffinity=0, group=_LAST_GROUP)  # fmt: skip
        friction = model.geom_friction[robot.ground]
        spec.add_pair(geomname1=plane.name, geomname2=part, condim=max(3, *sizes),
                      friction=[friction[0], friction[0], *friction[[1, 2, 2]]],
                      solimp=list(model.geom_solimp[robot.ground]))  # fmt: skip
    ground = next(geom for geom in spec.geoms if geom.name == level)
    ground.contype = ground.conaffinity = 0


def pairs_with_planes(model: mujoco.MjModel) -> np.ndarray:
    """Numbers of the pairs of a part and the plane below it."""
    first, second = model.pair_geom1, model.pair_geom2
    return np.array([
        i for i in range(model.npair) if model.geom(first[i]).name == plane_below(model.geom(second[i]).name)
    ], dtype=int)  # fmt: skip


def name_geoms(spec: mujoco.MjSpec) -> None:
    """Gives geoms without a name one."""
    for number, geom in enumerate(spec.geoms):
        if not geom.name:
            geom.name = f"geom_{number}"


def _ends(model: mujoco.MjModel, geom: int) -> list[_Ball]:
    """The two ends of a capsule."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    along = model.geom_size[geom, 1] * turn.reshape(3, 3)[:, 2]
    return [_Ball(int(model.geom_bodyid[geom]), tuple((model.geom_pos[geom] + sign * along).tolist()),
                  float(model.geom_size[geom, 0])) for sign in (1.0, -1.0)]  # fmt: skip


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
