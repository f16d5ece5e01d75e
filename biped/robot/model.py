"""models/*.xml → a MuJoCo model with only what the run needs, and Pinocchio's model of the same file.

Coordinates are x, z of the torso's centre of mass, pitch, then hip, knee and ankle leg by leg. Pinocchio's model has
them in this canonical order; MuJoCo's has the file's (`biped.robot.order`). The plane of motion is fixed to the
ground, so a slope is a direction of gravity.
"""

from __future__ import annotations

import math
import warnings
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import description_of, label, nearest
from biped.robot.check import check_model, check_parts
from biped.robot.description import Robot, robot_at
from biped.robot.ground import box_of, is_level, levelled
from biped.robot.order import Order, order_of
from biped.robot.safety import examine, packaged
from biped.robot.sizes import check_sizes
from biped.robot.topology import BASE, NU, PARENT, POINT_LINK, THIGH, TORSO
from biped.robot.tree import Tree, tree_of
from biped.robot.trial import tried
from biped.scenario.ground import Ground
from biped.scenario.keys import Scenario, Simulation, Truth

if TYPE_CHECKING:
    import pinocchio

GRAVITY = 9.81
"""[m/s²]"""
SEAT, PELVIS = "seat", "pelvis on the seat"
"""Geoms of a scenario's seat."""
# Without a handler every MuJoCo warning is appended to MUJOCO_LOG.TXT in the user's folder; the engine reports them.
mujoco.set_mju_user_warning(lambda message: None)


class Foreign(NamedTuple):
    """What the MuJoCo engine steps.

    Attributes:
        model: Compiled MuJoCo model.
        order: Where it has what.
        tree: Its lengths and masses.
        spare: What runs that have ended stepped, for those to come: to make one takes as long as fifty steps.
    """

    model: mujoco.MjModel
    order: Order
    tree: Tree
    spare: list[mujoco.MjData]


def gravity(slope: float) -> tuple[float, float]:
    """Gravity (x, z) [m/s²] in the frame of a slope [degrees]."""
    return -GRAVITY * math.sin(math.radians(slope)), -GRAVITY * math.cos(math.radians(slope))


def _version(path: Path) -> tuple[str, float, float]:
    """A model file as it is now, with its description."""
    return str(path), path.stat().st_mtime, description_of(path).stat().st_mtime


@lru_cache(maxsize=8)
def _checked(path: str, modified: float, described: float) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """Parses, compiles and checks a model file once per version of it; first elsewhere if it may be anybody's."""
    file = Path(path)
    if not packaged(file):
        examine(file)
        tried(label(file), lambda: _survives(path))
    return _parsed(path)


def _parsed(path: str) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    name, robot = label(Path(path)), robot_at(Path(path))
    try:
        spec = mujoco.MjSpec.from_file(path)
        check_parts(spec, name, robot)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # what MuJoCo only warns of (a singular inertia) no run survives
            model = spec.compile()
    except (ValueError, UserWarning, mujoco.FatalError) as error:
        raise InputError(f"{name}: not a model MuJoCo can compile: {' '.join(str(error).split())}") from None
    check_model(model, name, robot)
    return spec, model


def _survives(path: str) -> None:
    """Everything that is ever done with a model file, once."""
    _, model = _parsed(path)
    check_sizes(model, label(Path(path)))
    mujoco.mj_step(model, mujoco.MjData(model))
    _pinocchio(path, 0.0, 0.0)


def spec_of(path: Path) -> mujoco.MjSpec:
    """A private copy of the parsed model file."""
    return _checked(*_version(path))[0].copy()


def true_tree(tree: Tree, truth: Truth) -> Tree:
    """Lengths and masses of the biped that walks, given those of the model file."""
    mass, length = np.array(truth.mass), np.array(truth.length)
    parent = length[list(PARENT)]
    scaled = tree._replace(
        joint=tree.joint * parent[:, None],
        com=tree.com * length[:, None],
        mass=tree.mass * mass,
        inertia=tree.inertia * mass * length**2 * np.array(truth.inertia),
        damping=tree.damping + truth.joint_damping,
        point=tree.point * length[list(POINT_LINK)][:, None],
    )
    return scaled if truth.hip_mass == 0.0 else _with_hip_mass(scaled, truth.hip_mass)


def _with_hip_mass(tree: Tree, hip: float) -> Tree:
    """The tree whose torso carries a point mass [kg] on the hip's axis too."""
    own, at = float(tree.mass[TORSO]), tree.joint[THIGH[0]] - tree.com[TORSO]
    com, mass, inertia = np.array(tree.com), np.array(tree.mass), np.array(tree.inertia)
    mass[TORSO] = own + hip
    com[TORSO] += hip / (own + hip) * at
    inertia[TORSO] += own * hip / (own + hip) * float(at @ at)
    return tree._replace(com=com, mass=mass, inertia=inertia)


def _apply_truth(spec: mujoco.MjSpec, truth: Truth, robot: Robot) -> None:
    """Scales masses, inertias and lengths in a parsed model."""
    for i, link in enumerate(robot.links):
        body = spec.body(link)
        length = truth.length[i]
        body.mass *= truth.mass[i]
        body.inertia = body.inertia * (truth.mass[i] * length**2 * truth.inertia[i])
        body.ipos = body.ipos * length
        for part in [*body.sites, *body.geoms, *body.bodies]:
            part.pos = part.pos * length
        for geom in body.geoms:
            geom.fromto = geom.fromto * length
    if truth.hip_mass > 0.0:
        torso, hip = spec.body(robot.base.link), spec.body(robot.leg[0].links[0])
        total = torso.mass + truth.hip_mass
        at = np.array([hip.pos[0], 0.0, hip.pos[2]]) - torso.ipos
        torso.inertia = torso.inertia + torso.mass * truth.hip_mass / total * np.array(
            [at[2] ** 2, at @ at, at[0] ** 2]
        )
        torso.ipos = torso.ipos + truth.hip_mass / total * at
        torso.mass = total
    for joint in robot.joints[BASE:]:
        # MuJoCo 4 keeps a polynomial in the rate: linear, quadratic and cubic coefficient.
        spec.joint(joint).damping = spec.joint(joint).damping + np.array([truth.joint_damping, 0.0, 0.0])


def compile_foreign(path: Path, scenario: Scenario, visuals: bool = False) -> Foreign:
    """Compiles the scenario's ground truth: this ground, this solver, these limits, and no visuals unless wanted.

    Runs that differ in nothing of this share one model, which is not to be written to.

    Args:
        path: The MJCF file.
        scenario: What the run needs.
        visuals: Keep geoms that are only looked at.
    """
    s = scenario
    level = is_level(s.ground)
    # Heights along the way are no part of the model: only that there are any.
    return _compiled(*_version(path), levelled(s.ground), level, s.simulation, s.truth, torque_limits(s), visuals)


@lru_cache(maxsize=8)
def _compiled(
    file: str,
    modified: float,
    described: float,
    ground: Ground,
    level: bool,
    simulation: Simulation,
    truth: Truth,
    limits: tuple[float, ...],
    visuals: bool,
) -> Foreign:
    path = Path(file)
    spec, robot = spec_of(path), robot_at(path)
    if not visuals:
        kept = (robot.contact.ground, *robot.points)
        for geom in [g for g in spec.geoms if g.name not in kept]:
            spec.delete(geom)
        for light in list(spec.lights):
            spec.delete(light)
    if truth != Truth():
        _apply_truth(spec, truth, robot)
    option = spec.option
    option.timestep = simulation.timestep
    option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{simulation.integrator.upper()}")
    option.cone = getattr(mujoco.mjtCone, f"mjCONE_{simulation.cone.upper()}")
    option.impratio = simulation.impratio
    option.tolerance = simulation.tolerance
    option.iterations = simulation.iterations
    g = gravity(ground.slope)
    option.gravity = [g[0], 0.0, g[1]]
    solref = [ground.contact_time, ground.damping_ratio]
    for pair in spec.pairs:
        pair.friction = [ground.friction, ground.friction, 0.005, 0.0001, 0.0001]
        pair.solref = solref
    for stop in robot.stops:
        spec.joint(stop).solref_limit = solref
    if not level:
        _add_planes(spec)
    if ground.seat.height > 0.0:
        _add_seat(spec, ground, robot)
    for actuator, limit in zip(robot.actuators, limits, strict=True):
        spec.actuator(actuator).ctrlrange = [-limit, limit]
    model = spec.compile()
    if not level:
        for pair in model.pair_geom1:
            model.geom_sameframe[pair] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # otherwise its place is the world's
    return Foreign(model, order_of(model, robot), tree_of(model, label(path), robot), [])


def _add_planes(spec: mujoco.MjSpec) -> None:
    """Gives every contact pair a plane of its own, at first that of the level ground; nobody sees them."""
    for pair in spec.pairs:
        plane = spec.worldbody.add_geom(name=plane_below(pair.name), type=mujoco.mjtGeom.mjGEOM_PLANE)
        plane.size, plane.group, plane.contype, plane.conaffinity = [0.0, 0.0, 0.05], 5, 0, 0
        pair.geomname1 = plane.name


def _add_seat(spec: mujoco.MjSpec, ground: Ground, robot: Robot) -> None:
    """Puts a box on the ground and a sphere about the hips, which meets it.

    The sphere is the torso's: MuJoCo lists contacts by the bodies that meet, those of the feet after it.
    """
    seat, torso = ground.seat, spec.body(robot.base.link)
    hip = spec.body(robot.leg[0].links[0]).pos
    box = spec.worldbody.add_geom(name=SEAT, type=mujoco.mjtGeom.mjGEOM_BOX)
    box.pos, box.size = box_of(seat)
    pelvis = torso.add_geom(name=PELVIS, type=mujoco.mjtGeom.mjGEOM_SPHERE)
    pelvis.size, pelvis.pos, pelvis.mass, pelvis.group = [seat.pelvis, 0.0, 0.0], [hip[0], 0.0, hip[2]], 0.0, 3
    for geom in (box, pelvis):
        geom.contype, geom.conaffinity = 0, 0
    box.rgba = [0.72, 0.63, 0.52, 1.0]
    pair = spec.add_pair(name=SEAT, geomname1=SEAT, geomname2=PELVIS)
    pair.condim = 3
    pair.friction = [ground.friction, ground.friction, 0.005, 0.0001, 0.0001]
    pair.solref = [ground.contact_time, ground.damping_ratio]


def plane_below(point: str) -> str:
    """Name of the plane that stands for the ground below a contact point, where the ground is not level."""
    return f"ground below {point}"


def torque_limits(scenario: Scenario) -> tuple[float, ...]:
    """The six torque limits [N m] of a scenario."""
    limit = scenario.actuation.torque_limit
    return limit if isinstance(limit, tuple) else (limit,) * NU


def posture_of(path: Path, name: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """A named start posture: joint coordinates (9,), canonical order, and the points that touch the ground.

    Raises:
        InputError: The model has no such keyframe, or names points that do not exist.
    """
    spec, model = _checked(*_version(path))
    robot = robot_at(path)
    keys = {key.name: key for key in spec.keys}
    if name not in keys:
        raise InputError(
            f"start.posture: model {label(path)} has no keyframe '{name}'; {nearest(name, list(keys))}", "start.posture"
        )
    contacts = tuple(next((text.data for text in spec.texts if text.name == name), "").split())
    for contact in contacts:
        if contact not in robot.points:
            raise InputError(
                f"{label(path)}: text '{name}': '{contact}' is no contact point; {nearest(contact, list(robot.points))}"
            )
    return np.array(keys[name].qpos)[order_of(model, robot).joints], contacts


def bodies_of(path: Path) -> list[str]:
    """Names of a model file's bodies."""
    return [body.name for body in spec_of(path).bodies if body.name != "world"]


@lru_cache(maxsize=4)
def _pinocchio(path: str, modified: float, described: float) -> pinocchio.Model:
    import pinocchio

    try:
        return _canonical(pinocchio.buildModelFromMJCF(path), robot_at(Path(path)))
    except (ValueError, RuntimeError) as error:
        raise InputError(
            f"{label(Path(path))}: not a model Pinocchio can read: {' '.join(str(error).split())}"
        ) from error


def _canonical(model: pinocchio.Model, robot: Robot) -> pinocchio.Model:
    """Pinocchio's model with its legs in canonical order; the same one if they are."""
    import pinocchio

    root, *there = list(model.names)[1:]
    wanted = [root, *robot.joints[BASE:]]
    if [root, *there] == wanted:
        return model
    out = pinocchio.Model()
    out.name, number = model.name, {0: 0}
    for name in wanted:
        old = model.getJointId(name)
        new = out.addJoint(number[model.parents[old]], model.joints[old], model.jointPlacements[old], name)
        out.appendBodyToJoint(new, model.inertias[old], pinocchio.SE3.Identity())
        at, to = model.joints[old].idx_v, out.joints[new].idx_v
        size = model.joints[old].nv
        for values in ("armature", "damping"):
            getattr(out, values)[to : to + size] = getattr(model, values)[at : at + size]
        number[old] = new
    for frame in model.frames:
        if frame.type == pinocchio.FrameType.OP_FRAME:
            joint = number[frame.parentJoint]
            out.addFrame(pinocchio.Frame(frame.name, joint, 0, frame.placement, frame.type))
    return out


def believed_model(path: Path, slope: float) -> pinocchio.Model:
    """Pinocchio's model of the file, which the controller computes with; gravity as on the scenario's slope."""
    import pinocchio

    model = pinocchio.Model(_pinocchio(*_version(path)))
    g = gravity(slope)
    model.gravity.linear = np.array([g[0], 0.0, g[1]])
    return model


def tree_at(path: Path) -> Tree:
    """Lengths and masses written in a model file; not to be written to."""
    return _tree(*_version(path))


@lru_cache(maxsize=8)
def _tree(path: str, modified: float, described: float) -> Tree:
    return tree_of(_checked(path, modified, described)[1], label(Path(path)), robot_at(Path(path)))
