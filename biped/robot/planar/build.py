"""The model of seven links that MuJoCo steps in a run: only what the run needs, its ground, solver and limits."""

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import mujoco

from biped.base.files import label
from biped.robot.ground import box_of, gravity, is_level, levelled
from biped.robot.planar.description import PlanarParts, description_at, version_of
from biped.robot.planar.model import spec_of
from biped.robot.planar.order import Order, order_of
from biped.robot.planar.topology import NU
from biped.robot.planar.tree import Tree, apply_truth, tree_of
from biped.robot.spec import set_solver
from biped.scenario.keys import Scenario, Simulation, Truth
from biped.scenario.world import Ground

SEAT, PELVIS = "seat", "pelvis on the seat"
"""Geoms of a scenario's seat."""


class Foreign(NamedTuple):
    """A compiled model of seven links, with its order and lengths.

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
    return _compiled(*version_of(path), levelled(s.ground), level, s.simulation, s.truth, _limits(s), visuals)


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
    spec, robot = spec_of(path), description_at(path)
    if not visuals:
        kept = (robot.contact.ground, *robot.points)
        for geom in [g for g in spec.geoms if g.name not in kept]:
            spec.delete(geom)
        for light in list(spec.lights):
            spec.delete(light)
    if truth != Truth():
        apply_truth(spec, truth, robot)
    option = spec.option
    set_solver(option, simulation)
    option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)  # the ground is the scenario's
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


def _add_seat(spec: mujoco.MjSpec, ground: Ground, robot: PlanarParts) -> None:
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


def _limits(scenario: Scenario) -> tuple[float, ...]:
    """The six torque limits [N m] of a scenario."""
    limit = scenario.actuation.torque_limit
    return limit if isinstance(limit, tuple) else (limit,) * NU
