"""The law out of the plane and MuJoCo in one compiled loop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from biped.base.address import call, doubles_at, int32_at
from biped.base.jit import long_kernel, kernel
from biped.control.spatial.places import Mechanics
from biped.control.spatial.tick import spatial_tick
from biped.control.spatial.topology import BASE, KNEE, LEG, LEGS, N, N_POINTS, NU

Q, V, U, FORCE, POINT, Q_D, COM, COM_V, PHASE, PLACED, LIMITED, PRESSED = (
    0, 19, 37, 49, 73, 97, 115, 118, 121, 123, 125, 126
)
WIDTH = 128


class Plant(NamedTuple):
    """MuJoCo as the compiled loop takes it; see `biped.engines.native`."""

    step1: int
    step2: int
    step: int
    model: int
    data: int
    nefc: int
    force: int
    substeps: int
    mechanics: Mechanics
    ctrl: np.ndarray
    applied: np.ndarray
    pushed: np.ndarray
    pushes: np.ndarray  # (n, 5): from, until tick, force
    radius: float
    timestep: float


@kernel
def _log_forces(line, m, efc, radius):
    at = 0
    for leg in range(LEGS):
        if m.q[BASE + 1 + LEG * leg + KNEE] > 0.0:
            at += 1
    for p in range(N_POINTS):
        geom = m.points[p]
        for i in range(3):
            line[FORCE + 3 * p + i] = 0.0
        if line[POINT + 3 * p + 2] < radius and at + 3 <= efc.size:
            line[FORCE + 3 * p] = -efc[at + 2]
            line[FORCE + 3 * p + 1] = efc[at + 1]
            line[FORCE + 3 * p + 2] = efc[at]
            at += 3
    return at


@long_kernel
def walk_spatial(record, plant, log, first, last):
    m = plant.mechanics
    c = record[0]
    for k in range(first, last):
        call(plant.step1, plant.model, plant.data)
        status = spatial_tick(record, m, k == 0)
        line = log[k]
        for j in range(N):
            line[V + j] = m.v[j]
            line[Q_D + j] = c["tick"]["Q_d"][j]
        for j in range(N + 1):
            line[Q + j] = m.q[j]
        for j in range(NU):
            line[U + j] = c["tick"]["u"][j]
        for i in range(3):
            line[COM + i] = c["at"]["com"][i]
            line[COM_V + i] = c["at"]["com_velocity"][i]
        for leg in range(LEGS):
            line[PHASE + leg] = c["memory"]["phase"][leg] + 1
            line[PLACED + leg] = c["tick"]["placed"][leg]
        for p in range(N_POINTS):
            for i in range(3):
                line[POINT + 3 * p + i] = m.place[m.points[p], i]
        line[LIMITED] = c["tick"]["limited"]
        if status != 0:
            return status, k + 1
        if c["actuation"]["generalized"] == 0:
            for j in range(NU):
                plant.ctrl[j] = c["tick"]["u"][j]
        else:
            for j in range(N):
                plant.applied[j] = c["tick"]["Q_d"][j]
        for i in range(3):
            plant.pushed[i] = 0.0
        for i in range(plant.pushes.shape[0]):
            if plant.pushes[i, 0] <= k < plant.pushes[i, 1]:
                for j in range(3):
                    plant.pushed[j] += plant.pushes[i, 2 + j]
        call(plant.step2, plant.model, plant.data)
        efc = doubles_at(plant.force, int32_at(plant.nefc))
        line[PRESSED] = efc.size - _log_forces(line, m, efc, plant.radius)
        for _ in range(plant.substeps - 1):
            call(plant.step, plant.model, plant.data)
    return 0, last
