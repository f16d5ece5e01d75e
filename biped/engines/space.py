"""The compiled loop of a biped with a free base under the law `thesis`: which runs it suits, and its plant."""

import math
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.address import call, doubles_at, int32_at
from biped.base.jit import inner_kernel, long_kernel
from biped.control.blending import blend
from biped.control.space.dynamics import compute_mechanics
from biped.control.space.law import Spatial
from biped.control.space.mistaken import mistaken_tick
from biped.control.space.own import Own
from biped.control.space.places import Mechanics
from biped.control.space.record import BASE, KNEE, LEG, LEGS, N_POINTS
from biped.control.space.setup import mechanics_of
from biped.control.space.tick import spatial_tick
from biped.engines.forces import add_moment, write_com_velocity, write_spin
from biped.engines.loop import GOING, LOW, NOT_FINITE, TILTED
from biped.engines.native import halves, without_clock
from biped.engines.row import CONTACT, FIGURE, FORCE, GIVEN, GROUND_FORCE, POINT, WORK, U, write_state
from biped.engines.stepping import Stepped
from biped.robot.robot import Robot
from biped.scenario.keys import COMPILED, PINOCCHIO


class SpacePlant(NamedTuple):
    """MuJoCo as the compiled loop takes it; see `biped.engines.native`.

    Attributes:
        step1: Address of mj_step1.
        step2: Address of mj_step2.
        model: Address of the model.
        data: Address of the data.
        nefc: Address of the number of constraint rows.
        force: Address of the address of their forces.
        substeps: Steps in a tick.
        timestep: [s].
        mechanics: What MuJoCo knows of the walker, live.
        own: (`biped.control.space.own.Own`,) where the law computes its mechanics by itself, otherwise ().
        applied: (12,) torques or (18,) generalized forces, live.
        pushed: (6,) [N, N m] force and moment on the torso, live.
        driving: (18,) what actuators do, live.
        holding: (18,) what contacts and stops do, live.
        com: (3,) [m] centre of mass, live.
        inertia: (8, 10) of the bodies about it, live.
        moving: (8, 6) their velocities there, live.
        centre: (8, 3) centres of mass of the bodies, live.
        place: (8, 3) origins of the bodies, live.
        points: (8,) geoms that are contact points.
        geoms: (ngeom, 3) [m] places of geoms, live.
        energy: (2,) [J], live.
        turned: (8, 4) orientations of the bodies, live.
        anchor: (njnt, 3) [m] places of the joints, live.
        anchors: (6,) joints that a stick figure shows.
        top: (3,) [m] the trunk's end in the torso's frame.
        radius: [m] of the contact points' spheres.
        least: [m] height of the torso below which it has fallen.
        up: (3,) against gravity.
        tilt: Cosine of the lean beyond which it has fallen.
        columns: (15,) first columns of a trajectory's quantities, in their order.
        touched: (8,) which contact points touch in a step, work.
        stopped: (2,) which knees are at their stop, work.
        before: (18,) velocities before a step, work.
        acting: (2, 3) place and force of one that acts from outside, work.
        com_velocity: (3,) [m/s] of the centre of mass, work.
    """

    step1: int
    step2: int
    model: int
    data: int
    nefc: int
    force: int
    substeps: int
    timestep: float
    mechanics: Mechanics
    own: tuple[Own, ...]
    applied: np.ndarray
    pushed: np.ndarray
    driving: np.ndarray
    holding: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    moving: np.ndarray
    centre: np.ndarray
    place: np.ndarray
    points: np.ndarray
    geoms: np.ndarray
    energy: np.ndarray
    turned: np.ndarray
    anchor: np.ndarray
    anchors: np.ndarray
    top: np.ndarray
    radius: float
    least: float
    up: np.ndarray
    tilt: float
    columns: np.ndarray
    touched: np.ndarray
    stopped: np.ndarray
    before: np.ndarray
    acting: np.ndarray
    com_velocity: np.ndarray


@inner_kernel
def _status(plant):
    m = plant.mechanics
    for j in range(m.v.size):
        if not (math.isfinite(m.q[j]) and math.isfinite(m.v[j])):
            return NOT_FINITE
    up, R = plant.up, m.turned[1]
    if R[2] * up[0] + R[5] * up[1] + R[8] * up[2] < plant.tilt:
        return TILTED
    return LOW if plant.centre[1, 2] < plant.least else GOING


@inner_kernel
def decide(record, m, own, first):
    """The law's tick. Only that for the mechanics of a run is compiled: a tuple's length is part of its type."""
    if len(own) == 0:
        spatial_tick(record, m, first)
        return
    compute_mechanics(own[0].tree, own[0].mechanics)
    if len(own) == 1:
        spatial_tick(record, own[0].mechanics, first)
    else:
        mistaken_tick(record, own[0].mechanics, own[1].tree, own[1].mechanics, first)


@inner_kernel
def write_signals(c, line):
    """Writes a tick's signals (`biped.control.space.law.SIGNALS`)."""
    for leg in range(LEGS):
        line[leg] = c["memory"]["phase"][leg] + 1
        line[LEGS + leg] = c["tick"]["placed"][leg]
    line[2 * LEGS] = c["tick"]["limited"]
    line[2 * LEGS + 1] = 1.0 if c["tick"]["given_up"] > 0 else 0.0


@inner_kernel
def _note(plant, line, outside, time):
    """Writes the state at a tick into its row: the robot's own, whatever masses the law believes in."""
    m, at = plant.mechanics, plant.columns
    write_com_velocity(plant.inertia, plant.moving, plant.com_velocity)
    write_state(at, line, time, m.q, m.v, plant.com, plant.com_velocity, plant.place[1], plant.turned[1],
                plant.energy)  # fmt: skip
    for p in range(N_POINTS):
        for i in range(3):
            line[at[POINT] + 3 * p + i] = plant.geoms[plant.points[p], i]
        line[at[CONTACT] + p] = 1.0 if plant.geoms[plant.points[p], 2] < plant.radius else 0.0
    for k in range(plant.anchors.size):
        for i in range(3):
            line[at[FIGURE] + 3 * k + i] = plant.anchor[plant.anchors[k], i]
    R, top = m.turned[1], line[at[FIGURE] + 3 * plant.anchors.size :]
    for i in range(3):
        top[i] = plant.place[1, i]
        for j in range(3):
            top[i] += R[3 * i + j] * plant.top[j]
    write_spin(plant.inertia, plant.moving, outside)


@inner_kernel
def _add_outside(plant, out, share):
    """Adds what the push and, of generalized forces, the law do from outside in the step."""
    place, force = plant.acting[0], plant.acting[1]
    for i in range(3):
        place[i], force[i] = plant.centre[1, i], share * plant.pushed[i]
        out[i] += force[i]
    add_moment(place, plant.com, force, out)
    if plant.applied.size != plant.mechanics.v.size:
        return
    R = plant.mechanics.turned[1]
    for i in range(3):
        place[i], force[i] = plant.place[1, i], share * plant.applied[i]
        out[i] += force[i]
        for j in range(3):
            out[3 + i] += R[3 * i + j] * share * plant.applied[3 + j]
    add_moment(place, plant.com, force, out)


@inner_kernel
def _add_forces(plant, line, outside, share):
    """Adds the ground's forces in the step that has been taken; stops come first among them, then points in order."""
    at, efc = plant.columns, doubles_at(plant.force, int32_at(plant.nefc))
    at_point = plant.acting[0]
    row = 0
    for leg in range(LEGS):
        if plant.stopped[leg]:
            row += 1
    for p in range(N_POINTS):
        if plant.touched[p] and row + 3 <= efc.size:
            for i in range(3):
                # Normal, to the left, backward.
                force = share * (efc[row] if i == 2 else efc[row + 1] if i == 1 else -efc[row + 2])
                line[at[FORCE] + 3 * p + i] += force
                line[at[GROUND_FORCE] + i] += force
                plant.acting[1, i] = force
                outside[i] += force
                at_point[i] = plant.geoms[plant.points[p], i]
            at_point[2] = 0.5 * (at_point[2] - plant.radius)
            add_moment(at_point, plant.com, plant.acting[1], outside)
            row += 3


@inner_kernel
def _step(plant, line, outside, share):
    """Takes one step, whose first half is done, and adds to the row what happens in it."""
    m, at, before = plant.mechanics, plant.columns, plant.before
    for p in range(N_POINTS):
        plant.touched[p] = plant.geoms[plant.points[p], 2] < plant.radius
    for leg in range(LEGS):
        plant.stopped[leg] = m.q[BASE + 1 + LEG * leg + KNEE] > 0.0
    for j in range(m.v.size):
        before[j] = m.v[j]
    call(plant.step2, plant.model, plant.data)
    _add_forces(plant, line, outside, share)
    _add_outside(plant, outside, share)
    given, held = 0.0, 0.0
    generalized = plant.applied.size == m.v.size
    for j in range(m.v.size):
        step = 0.5 * plant.timestep * (before[j] + m.v[j])
        force = plant.applied[j] if generalized else plant.driving[j]
        given += ((force + plant.pushed[j]) if j < BASE else force) * step
        held += plant.holding[j] * step
    line[at[WORK]] += given + held
    line[at[GIVEN]] += given


@long_kernel
def walk(record, changes, plant, log, outside, signals, first, last):
    """Ticks first … last - 1 of a run in which the same push acts on the torso's centre of mass.

    Args:
        record: (1,) `biped.control.space.record.control_type`.
        changes: Of it, `biped.control.blending.Changes`.
        plant: `SpacePlant`.
        log: (n, width) of `biped.robot.columns`, zero where nothing is known yet.
        outside: (n, 9) of `Trajectory.outside`, likewise.
        signals: (n, 6) of `biped.control.space.law`.
        first: First tick.
        last: One past the last.

    Returns:
        The last tick's status (`biped.engines.loop`), and the number of rows in the log.
    """
    m, c = plant.mechanics, record[0]
    share = 1.0 / plant.substeps
    tick = plant.timestep * plant.substeps
    for k in range(first, last):
        call(plant.step1, plant.model, plant.data)
        status = _status(plant)
        if status == NOT_FINITE:
            return status, k + 1
        blend(changes, k)
        decide(record, m, plant.own, k == 0)
        line = log[k]
        _note(plant, line, outside[k], k * tick)
        if status != GOING:
            return status, k + 1
        write_signals(c, signals[k])
        if c["actuation"]["generalized"]:
            for j in range(m.v.size):
                plant.applied[j] = c["tick"]["Q_d"][j] + c["tick"]["passive"][j]
        else:
            for j in range(plant.applied.size):
                plant.applied[j] = c["tick"]["u"][j]
                line[plant.columns[U] + j] = c["tick"]["u"][j]
        for step in range(plant.substeps):
            if step > 0:
                call(plant.step1, plant.model, plant.data)
            _step(plant, line, outside[k, 3:], share)
    return GOING, last


_AT_ORIGIN = 1e-9
"""[m] A push on a centre of mass that is no further from its body's origin has no moment about it."""


class SpaceLoop:
    """The loop of a run on eight spheres.

    Args:
        plant: Of the run.
        space: What compiled code takes.
    """

    def __init__(self, plant: Stepped, space: SpacePlant):
        self._plant, self._space = plant, space

    def takes(self, forces: np.ndarray) -> bool:
        """Whether it can be pushed by forces (bodies, 3) [N]: by those that act on the base's origin."""
        model, base, pushed = self._plant.model, self._plant.robot.base_number, np.flatnonzero(forces.any(axis=1)) + 1
        return all(body == base and np.abs(model.body_ipos[body]).max() < _AT_ORIGIN for body in pushed)

    def advance(self, first: int, last: int) -> tuple[int, int]:
        """Ticks first … last - 1, in which the same push acts; see `biped.engines.loop.Plant`."""
        plant, law = self._plant, self._plant.law
        with without_clock():
            return walk(law.law.record, law.law.changes, self._space, plant.log, plant.outside, law.signals.values,
                        first, last)  # fmt: skip


def compiles(law: Spatial) -> bool:
    """Whether compiled code can tick a law: Pinocchio is called from Python, and so is one that is mistaken about M."""
    return law.source != PINOCCHIO and (law.source == COMPILED or not law.mistaken)


def space_loop(plant: Stepped) -> SpaceLoop | None:
    """The loop of a run, or None where it has no feet of eight spheres or must be stepped from Python.

    Args:
        plant: Of a run of the law.
    """
    law: Spatial = plant.law.law
    model, data, robot = plant.model, plant.data, plant.robot
    if not compiles(law) or plant.senses or model.opt.cone != mujoco.mjtCone.mjCONE_ELLIPTIC:
        return None
    strength, _, follow = plant.actuators()
    if strength != 1.0 or follow < 1.0:
        return None
    if not _on_spheres(model, robot):
        return None
    if (native := halves(model)) is None:
        return None
    generalized = bool(law.record["actuation"]["generalized"][0])
    mechanics = mechanics_of(law.record[0], model, data)
    points = np.array([geom for foot in robot.feet for geom in foot.geoms])
    gravity = np.array(model.opt.gravity)
    fall, columns = plant.run.scenario.fall, plant.columns
    return SpaceLoop(plant, SpacePlant(
        step1=native.step1, step2=native.step2, model=model._address, data=data._address,
        nefc=data._address + native.nefc, force=data._address + native.force,
        substeps=plant.run.substeps, timestep=float(model.opt.timestep), mechanics=mechanics,
        own=law.owns(data.qpos, data.qvel),
        applied=data.qfrc_applied if generalized else data.ctrl, pushed=data.xfrc_applied[robot.base_number],
        driving=data.qfrc_actuator, holding=data.qfrc_constraint, com=data.subtree_com[robot.base_number],
        inertia=data.cinert, moving=data.cvel, centre=data.xipos, place=data.xpos,
        points=points, geoms=data.geom_xpos, energy=data.energy, turned=data.xquat, anchor=data.xanchor,
        anchors=plant.state.anchors, top=np.array(robot.top),
        radius=float(model.geom_size[points[0], 0]),
        least=float(plant.state.bounds[0]), up=-gravity / np.linalg.norm(gravity),
        tilt=math.cos(math.radians(fall.tilt)),
        columns=np.array([first for first, _ in columns.values()]),
        touched=np.zeros(len(points), np.uint8), stopped=np.zeros(len(robot.feet), np.uint8),
        before=np.zeros(model.nv), acting=np.zeros((2, 3)), com_velocity=np.zeros(3),
    ))  # fmt: skip


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
