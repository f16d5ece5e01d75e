"""The foreign engine of seven links: MuJoCo's compliant contacts, with the controller in one compiled loop."""

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.address import call, doubles_at, int32_at
from biped.base.errors import InputError
from biped.base.jit import begun, bound, long_kernel
from biped.engines.loop import drive, mujoco_warnings
from biped.engines.native import native as native_of
from biped.engines.native import without_clock
from biped.engines.planar.ground import Planes, Seated, lay, log_forces, log_seat, planes_of, seated
from biped.engines.planar.plant import Physics, PlanarPlant, tick
from biped.engines.uneven import LEAST_FRICTION, PatchedPairs, patch_pairs, patched_pairs
from biped.measure.trajectory import Trajectory
from biped.robot.planar.build import Foreign
from biped.robot.robot import seven_links
from biped.robot.run import Run
from biped.robot.unmodelled import patches_of


class WalkPlant(NamedTuple):
    """MuJoCo as compiled loops take it; see `biped.engines.native`.

    Attributes:
        step: Address of mj_step.
        model: Address of the model.
        data: Address of the data.
        nefc: Address of the number of constraint rows.
        force: Address of the address of their forces.
        substeps: Steps in a tick.
        q: (9,) joint coordinates [m, rad], live.
        v: (9,) joint velocities, live.
        applied: (6,) joint torques or (9,) generalized forces, live.
        place: (ngeom, 3) [m] geom positions, live.
        points: (4,) geoms of the contact points.
        radius: [m] of those geoms.
        contacts: (4,) points in the order in which MuJoCo lists contacts.
        stops: (2,) stops in the order in which MuJoCo lists joint limits.
        bent: (2,) [rad] the other ends of their ranges.
        pyramid: Coefficient of friction of a pyramidal cone; 0 for an elliptic one.
        kinematics: Address of mj_kinematics.
        planes: The ground below the points.
        seat: What can be sat on, (`Seated`,), or (): a tuple's length is part of its type.
        patched: Ground that differs from place to place, (`PatchedPairs`,), or (), likewise.
    """

    step: int
    model: int
    data: int
    nefc: int
    force: int
    substeps: int
    q: np.ndarray
    v: np.ndarray
    applied: np.ndarray
    place: np.ndarray
    points: np.ndarray
    radius: float
    contacts: np.ndarray
    stops: np.ndarray
    bent: np.ndarray
    pyramid: float
    kinematics: int
    planes: Planes
    seat: tuple[Seated, ...]
    patched: tuple[PatchedPairs, ...]


@long_kernel
def walk_plant(plant, control, fall, log, first, last):
    """Ticks first … last - 1 of a run.

    Args:
        plant: `WalkPlant`.
        control: `biped.control.planar.loop.Control`.
        fall: (1,) `biped.engines.planar.plant.FALL`.
        log: (n, WIDTH) log.
        first: First tick.
        last: One past the last.

    Returns:
        The status of the last tick and the number of ticks logged.
    """
    for k in range(first, last):
        status = tick(control, fall, plant.q, plant.v, plant.applied, log, k)
        if status != 0:
            return status, k + 1
        for _ in range(plant.substeps):
            uneven = plant.planes.ground[0]["count"] > 0
            if uneven or len(plant.patched) > 0:
                call(plant.kinematics, plant.model, plant.data)
            if uneven:
                lay(plant.planes, plant.place, plant.points)
            patch_pairs(plant.patched, plant.place, plant.points)
            call(plant.step, plant.model, plant.data)
        force = doubles_at(plant.force, int32_at(plant.nefc))
        log_forces(log, k, force, plant.place, plant.points, plant.radius, plant.contacts, plant.stops, plant.bent,
                   plant.pyramid, plant.planes)  # fmt: skip
        log_seat(plant.seat, log, k, force, plant.place, plant.points, plant.radius, plant.stops, plant.bent,
                 plant.pyramid, plant.planes)  # fmt: skip
    return 0, last


Watch = Callable[[mujoco.MjModel, mujoco.MjData, np.ndarray], None]
"""Called after every tick with the model, its data, and the pushes that act, (bodies, 2) [N]."""


def simulate(run: Run, watch: Watch | None = None) -> Trajectory:
    """Simulates a run to its end, a fall or a number that is not finite.

    Args:
        run: A concrete run.
        watch: Who looks on; the ticks are Python's then, and the model has its visual geoms.

    Returns:
        What it left behind.

    Raises:
        InputError: A push names a body the model lacks, or a user's law misbehaves.
    """
    s = run.scenario
    foreign = run.planar_model(visuals=watch is not None)
    order, robot = foreign.order, seven_links(run.robot)
    native = None if s.law is not None or watch is not None or not order.canonical else native_of(foreign.model, order)
    ground = run.profile
    patches = patches_of(run)
    shared = ground.level and not patches
    model = foreign.model if shared else copy(foreign.model)  # whose planes move, or whose pairs change
    data = _data(foreign) if shared else mujoco.MjData(model)
    planes = planes_of(model, data, robot, ground)
    data.qpos[order.joints], data.qvel[order.joints] = run.q, run.v
    substeps = round(1.0 / s.simulation.control_rate / s.simulation.timestep)
    place, mj_step = data.geom_xpos, mujoco.mj_step
    where = order.points, robot.contact.radius, order.contacts, order.stops, order.bent
    patched = tuple(patched_pairs(one, model, robot) for one in patches)
    if patched and s.simulation.cone == "pyramidal":
        raise InputError("simulation.cone: expected 'elliptic' with truth.unmodelled.friction or softness of seven "
                         "links; got 'pyramidal'", "simulation.cone")  # fmt: skip
    pyramid = max(s.ground.friction or 0.0, LEAST_FRICTION) if s.simulation.cone == "pyramidal" else 0.0

    seat = (seated(data, order, round(s.duration * s.simulation.control_rate)),) if s.ground.seat.height > 0.0 else ()

    pushing = np.zeros((model.nbody - 1, 2))

    def push(forces: np.ndarray) -> None:
        pushing[:] = data.xfrc_applied[1:, [0, 2]] = forces

    log_of_step = None

    def step(k: int, log: np.ndarray) -> None:
        nonlocal log_of_step
        if shared:
            mj_step(model, data, substeps)
        else:
            for _ in range(substeps):
                mujoco.mj_kinematics(model, data)
                if not ground.level:
                    lay(planes, place, order.points)
                patch_pairs(patched, place, order.points)
                mj_step(model, data)
        if log_of_step is None:  # not all runs are stepped from Python
            log_of_step = bound(log_forces, log, 0, data.efc_force, place, *where, pyramid, planes)
        log_of_step(log, k, data.efc_force, place, *where, pyramid, planes)
        if seat:
            log_seat(seat, log, k, data.efc_force, place, order.points, robot.contact.radius, order.stops, order.bent,
                     pyramid, planes)  # fmt: skip
        if watch is not None:
            watch(model, data, pushing)

    generalized = s.actuation.mode == "generalized"
    applied = data.qfrc_applied if generalized else data.ctrl
    warnings = partial(mujoco_warnings, data)
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    if order.canonical:
        walk = None
        if native is not None:
            plant = WalkPlant(
                native.step, model._address, data._address, data._address + native.nefc, data._address + native.force,
                substeps, data.qpos, data.qvel, applied, place, *where, pyramid, native.kinematics, planes, seat,
                patched,
            )  # fmt: skip
            walk = partial(begun, walk_plant, plant)
        physics = Physics(foreign.tree, data.qpos, data.qvel, applied, bodies, push, step, walk, warnings)
    else:
        q, v, wanted = np.array(run.q), np.array(run.v), np.zeros(applied.size)
        places = order.joints if generalized else order.actuators

        def reordered(k: int, log: np.ndarray) -> None:
            applied[places] = wanted
            step(k, log)
            q[:], v[:] = data.qpos[order.joints], data.qvel[order.joints]

        physics = Physics(foreign.tree, q, v, wanted, bodies, push, reordered, None, warnings)
    with without_clock():
        trajectory = drive(PlanarPlant(run, physics))
    if watch is None and shared:  # who looked on may still look
        foreign.spare.append(data)
    sampled = substeps > 1 or s.simulation.integrator == "RK4"
    for one in seat:
        trajectory = replace(trajectory, seat=s.ground.seat, seat_force=one.force[: len(trajectory)])
    return replace(trajectory, sampled=sampled)


def _data(foreign: Foreign) -> mujoco.MjData:
    """The model and data that a run steps, reset."""
    try:
        data = foreign.spare.pop()
    except IndexError:
        return mujoco.MjData(foreign.model)
    mujoco.mj_resetData(foreign.model, data)
    return data
