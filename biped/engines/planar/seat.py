"""The force of a seat on a biped in MuJoCo, which the solver leaves among those of all contacts.

Only the pelvis meets the seat, and the pelvis is the torso's. Of MuJoCo's constraint forces along the torso's own
coordinates the feet's part is known from the log, and the stops act on none of them: what is left is the seat's.
"""

from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.jit import kernel
from biped.engines.planar.planes import above
from biped.measure.columns import FORCE, Q
from biped.robot.planar.order import Order
from biped.robot.planar.topology import BASE, KNEE, N_POINTS, PITCH, X, Z

SEAT = 3
"""Numbers of a seat's force: along the ground and normal to it [N], and its moment about the torso's origin [N m]."""


class Seated(NamedTuple):
    """A seat as compiled loops take it.

    Attributes:
        all: (nv,) MuJoCo's constraint forces in its coordinates, live.
        base: (3,) where the torso's coordinates are in them.
        force: (n, 3) what the log says of the seat.
    """

    all: np.ndarray
    base: np.ndarray
    force: np.ndarray


def seated(data: mujoco.MjData, order: Order, ticks: int) -> Seated:
    """The seat of a run of so many ticks."""
    return Seated(data.qfrc_constraint, order.joints[:BASE].copy(), np.zeros((ticks, SEAT)))


@kernel
def log_seat(seat, log, k, efc_force, place, points, radius, stops, bent, pyramid, planes):
    """Writes the seat's force, where there is one, in the physics step whose other forces row k of the log has by now.

    Args:
        seat: (`Seated`,), or ().
        log: The log.
        k: Row.
        efc_force: (nefc,) MuJoCo's constraint forces [N, N m], as of `biped.engines.planar.forces.log_forces`.
        place: Likewise.
        points: Likewise.
        radius: Likewise.
        stops: Likewise.
        bent: Likewise.
        pyramid: Likewise.
        planes: Likewise.
    """
    if len(seat) == 0:
        return
    line, out, everything = log[k], seat[0].force[k], seat[0].all
    rows = efc_force.size
    for leg in stops:
        if not bent[leg] <= line[Q + KNEE[leg]] <= 0.0:
            rows -= 1
    for i in range(N_POINTS):
        if above(planes, place, points, i) < radius:
            rows -= 4 if pyramid > 0.0 else 3
    if rows <= 0:  # the pelvis is off it: no rest of rounding
        out[:] = 0.0
        return
    for j in range(SEAT):
        out[j] = everything[seat[0].base[j]]
    for i in range(N_POINTS):
        fx, fz = line[FORCE + 2 * i], line[FORCE + 2 * i + 1]
        x, z = place[points[i], 0] - line[Q + X], place[points[i], 2] - line[Q + Z]
        out[X] -= fx
        out[Z] -= fz
        out[PITCH] -= x * fz - z * fx
