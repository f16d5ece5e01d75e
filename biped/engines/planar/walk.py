"""Controller and MuJoCo in one compiled loop: no Python between two ticks."""

from typing import NamedTuple

import numpy as np

from biped.base.address import call, doubles_at, int32_at
from biped.base.jit import long_kernel
from biped.engines.patches import PatchedPairs, patch_pairs
from biped.engines.planar.forces import log_forces
from biped.engines.planar.planes import Planes, lay
from biped.engines.planar.seat import Seated, log_seat
from biped.engines.planar.tick import tick


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
        fall: (1,) `biped.engines.planar.tick.FALL`.
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
