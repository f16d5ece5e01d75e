"""models/*.xml → a MuJoCo model with only what the run needs, and Pinocchio's model of the same file.

Coordinates of both: qpos = (x, z of the torso's centre of mass, pitch, hip, knee, ankle right, the same left); the
plane of motion is fixed to the ground, so a slope is a direction of gravity.
"""

from __future__ import annotations

import math
import warnings
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import pinocchio

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.robot.check import check_model, check_parts
from biped.robot.tree import JOINTS, LINKS, PARENT, POINT_LINK, POINTS, Tree, tree_of
from biped.scenario.keys import Ground, Scenario, Simulation, Truth

GRAVITY = 9.81
"""[m/s²]"""

# Without a handler every MuJoCo warning is appended to MUJOCO_LOG.TXT in the user's folder; the engine reports them.
mujoco.set_mju_user_warning(lambda message: None)


class Foreign(NamedTuple):
    """What the MuJoCo engine steps.

    Attributes:
        model: Compiled MuJoCo model.
        points: Geom numbers of the four contact points.
        tree: Its lengths and masses.
    """

    model: mujoco.MjModel
    points: np.ndarray
    tree: Tree


def gravity(slope: float) -> tuple[float, float]:
    """Gravity (x, z) [m/s²] in the frame of a slope [degrees]."""
    return -GRAVITY * math.sin(math.radians(slope)), -GRAVITY * math.cos(math.radians(slope))


@lru_cache(maxsize=8)
def _spec(path: str, modified: float) -> mujoco.MjSpec:
    """Parses and checks a model file once per version of it."""
    name = label(Path(path))
    try:
        spec = mujoco.MjSpec.from_file(path)
        check_parts(spec, name)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # what MuJoCo only warns of (a singular inertia) no run survives
            model = spec.compile()
    except (ValueError, UserWarning, mujoco.FatalError) as error:
        raise InputError(f"{name}: not a model MuJoCo can compile: {' '.join(str(error).split())}") from None
    check_model(model, name)
    return spec


def spec_of(path: Path) -> mujoco.MjSpec:
    """A private copy of the parsed model file."""
    return _spec(str(path), path.stat().st_mtime).copy()


def true_tree(tree: Tree, truth: Truth) -> Tree:
    """Lengths and masses of the biped that walks, given those of the model file."""
    mass, length = np.array(truth.mass), np.array(truth.length)
    parent = length[list(PARENT)]
    return tree._replace(
        joint=tree.joint * parent[:, None],
        com=tree.com * length[:, None],
        mass=tree.mass * mass,
        inertia=tree.inertia * mass * length**2 * np.array(truth.inertia),
        damping=tree.damping + truth.joint_damping,
        point=tree.point * length[list(POINT_LINK)][:, None],
    )


def _apply_truth(spec: mujoco.MjSpec, truth: Truth) -> None:
    """Scales masses, inertias and lengths in a parsed model."""
    for i, link in enumerate(LINKS):
        body = spec.body(link)
        length = truth.length[i]
        body.mass *= truth.mass[i]
        body.inertia = body.inertia * (truth.mass[i] * length**2 * truth.inertia[i])
        body.ipos = body.ipos * length
        for part in [*body.sites, *body.geoms, *body.bodies]:
            part.pos = part.pos * length
        for geom in body.geoms:
            geom.fromto = geom.fromto * length
    for joint in JOINTS[3:]:
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
    return _compiled(path, path.stat().st_mtime, s.ground, s.simulation, s.truth, torque_limits(s), visuals)


@lru_cache(maxsize=8)
def _compiled(
    path: Path,
    modified: float,
    ground: Ground,
    simulation: Simulation,
    truth: Truth,
    limits: tuple[float, ...],
    visuals: bool,
) -> Foreign:
    spec = spec_of(path)
    if not visuals:
        for geom in [g for g in spec.geoms if g.name != "ground" and g.name not in POINTS]:
            spec.delete(geom)
        for light in list(spec.lights):
            spec.delete(light)
    if truth != Truth():
        _apply_truth(spec, truth)
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
    for knee in ("right_knee", "left_knee"):
        spec.joint(knee).solref_limit = solref
    for actuator, limit in zip(spec.actuators, limits, strict=True):
        actuator.ctrlrange = [-limit, limit]
    model = spec.compile()
    points = np.array([model.geom(point).id for point in POINTS])
    return Foreign(model, points, tree_of(model, label(path)))


def torque_limits(scenario: Scenario) -> tuple[float, ...]:
    """The six torque limits [N m] of a scenario."""
    limit = scenario.actuation.torque_limit
    return limit if isinstance(limit, tuple) else (limit,) * 6


def posture_of(path: Path, name: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """A named start posture: joint coordinates (9,) and the points that touch the ground.

    Raises:
        InputError: The model has no such keyframe, or names points that do not exist.
    """
    spec = spec_of(path)
    keys = {key.name: key for key in spec.keys}
    if name not in keys:
        raise InputError(
            f"start.posture: model {label(path)} has no keyframe '{name}'; {nearest(name, list(keys))}", "start.posture"
        )
    contacts = tuple(next((text.data for text in spec.texts if text.name == name), "").split())
    for contact in contacts:
        if contact not in POINTS:
            raise InputError(
                f"{label(path)}: text '{name}': '{contact}' is no contact point; {nearest(contact, list(POINTS))}"
            )
    return np.array(keys[name].qpos), contacts


def bodies_of(path: Path) -> list[str]:
    """Names of a model file's bodies."""
    return [body.name for body in spec_of(path).bodies if body.name != "world"]


@lru_cache(maxsize=4)
def _pinocchio(path: str, modified: float) -> pinocchio.Model:
    try:
        return pinocchio.buildModelFromMJCF(path)
    except (ValueError, RuntimeError) as error:
        raise InputError(
            f"{label(Path(path))}: not a model Pinocchio can read: {' '.join(str(error).split())}"
        ) from error


def believed_model(path: Path, slope: float) -> pinocchio.Model:
    """Pinocchio's model of the file, which the controller computes with; gravity as on the scenario's slope."""
    model = pinocchio.Model(_pinocchio(str(path), path.stat().st_mtime))
    g = gravity(slope)
    model.gravity.linear = np.array([g[0], 0.0, g[1]])
    return model


def tree_at(path: Path) -> Tree:
    """Lengths and masses written in a model file; not to be written to."""
    return _tree(str(path), path.stat().st_mtime)


@lru_cache(maxsize=8)
def _tree(path: str, modified: float) -> Tree:
    return tree_of(_spec(path, modified).copy().compile(), label(Path(path)))
