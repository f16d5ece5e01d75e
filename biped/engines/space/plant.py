"""The compiled loop of a biped with a free base as a plant: which runs it suits, and what it is handed."""

import math

import mujoco
import numpy as np

from biped.control.law import Commander
from biped.control.space.law import Spatial
from biped.control.space.setup import mechanics_of
from biped.control.space.topology import BASE, KNEE, LEG, LEGS, N_POINTS
from biped.engines.native import halves, without_clock
from biped.engines.space.walk import SpacePlant, walk
from biped.robot.robot import Robot
from biped.scenario.keys import PINOCCHIO

_AT_ORIGIN = 1e-9
"""[m] A push on a centre of mass that is no further from its body's origin has no moment about it."""


def plant_of(
    law: object, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, substeps: int, least: float, tilt: float,
    columns: dict[str, tuple[int, tuple[int, ...]]], anchors: np.ndarray,
) -> SpacePlant | None:  # fmt: skip
    """The loop's plant, or None where the run must be stepped from Python.

    Args:
        law: The run's law.
        model: Its model.
        data: Its state.
        robot: What walks.
        substeps: Physics steps in a tick.
        least: [m] height of the torso below which it has fallen.
        tilt: Degrees of lean beyond which it has fallen.
        columns: Of the trajectory.
        anchors: Joints that a stick figure shows.
    """
    if not isinstance(law, Spatial) or law.source == PINOCCHIO or model.opt.cone != mujoco.mjtCone.mjCONE_ELLIPTIC:
        return None
    if not _on_spheres(model, robot):
        return None
    if (native := halves(model)) is None:
        return None
    generalized = bool(law.record["actuation"]["generalized"][0])
    mechanics = mechanics_of(law.record[0], model, data)
    points = np.array([geom for foot in robot.feet for geom in foot.geoms])
    own, gravity = law.own(data.qpos, data.qvel), np.array(model.opt.gravity)
    return SpacePlant(
        step1=native.step1, step2=native.step2, model=model._address, data=data._address,
        nefc=data._address + native.nefc, force=data._address + native.force,
        substeps=substeps, timestep=float(model.opt.timestep), mechanics=mechanics,
        own=() if own is None else (own,),
        applied=data.qfrc_applied if generalized else data.ctrl, pushed=data.xfrc_applied[robot.base_number],
        driving=data.qfrc_actuator, holding=data.qfrc_constraint, com=data.subtree_com[robot.base_number],
        inertia=data.cinert, moving=data.cvel, centre=data.xipos, place=data.xpos,
        points=points, geoms=data.geom_xpos, energy=data.energy, turned=data.xquat, anchor=data.xanchor,
        anchors=anchors, top=np.array(robot.top),
        radius=float(model.geom_size[points[0], 0]),
        least=least, up=-gravity / np.linalg.norm(gravity), tilt=math.cos(math.radians(tilt)),
        columns=np.array([first for first, _ in columns.values()]),
        touched=np.zeros(len(points), np.uint8), stopped=np.zeros(len(robot.feet), np.uint8),
        before=np.zeros(model.nv), acting=np.zeros((2, 3)),
    )  # fmt: skip


def _on_spheres(model: mujoco.MjModel, robot: Robot) -> bool:
    """Whether a robot is two legs on eight spheres, counted as the law counts, and nothing else meets the ground."""
    geoms = [geom for foot in robot.feet for geom in foot.geoms]
    limited = [j for j in range(model.njnt) if model.jnt_limited[j]]
    return (
        model.nv == BASE + LEGS * LEG
        and [drive.column for drive in robot.drives] == list(range(BASE, model.nv))
        and bool((model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_SPHERE).all())
        and len(geoms) == N_POINTS
        and [model.jnt_dofadr[j] for j in limited] == [BASE + LEG * leg + KNEE for leg in range(LEGS)]
        and model.npair > N_POINTS
        and not model.geom_contype.any()
    )


def on_base(forces: np.ndarray, model: mujoco.MjModel, robot: Robot) -> bool:
    """Whether forces (bodies, 3) act on nothing but the base, at its origin."""
    pushed = np.flatnonzero(forces.any(axis=1)) + 1
    return all(body == robot.base_number and np.abs(model.body_ipos[body]).max() < _AT_ORIGIN for body in pushed)


def advance(
    plant: SpacePlant, law: Commander, log: np.ndarray, outside: np.ndarray, first: int, last: int
) -> tuple[int, int]:
    """Ticks first … last - 1, in which the same push acts; see `biped.engines.loop.Plant`."""
    with without_clock():
        return walk(law.law.record, law.law.changes, plant, log, outside, law.signals.values, first, last)
