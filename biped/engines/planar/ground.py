"""Ground, knees' stops and seat of seven links in MuJoCo: planes below the contact points, and the solver's forces.

Ground that is not level is a plane for each contact point, laid along the piece of ground below it. Planes belong to
the world; before every physics step they are moved to where the points then are, so that a point meets exactly the
line of `biped.robot.ground`, whose corners no shape of MuJoCo's has without faces and edges of its own that a sinking
point would be pushed out of sideways. Level ground is the model file's plane, and nothing is moved.

The force of a seat the solver leaves among those of all contacts. Only the pelvis meets the seat, and the pelvis is the
torso's. Of MuJoCo's constraint forces along the torso's own coordinates the feet's part is known from the log, and the
stops act on none of them: what is left is the seat's.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.robot.columns import FORCE, STOP, Q
from biped.robot.ground import GROUND, Profile, height_below, piece_below, rise_of, set_ground
from biped.robot.planar.build import plane_below
from biped.robot.planar.description import PlanarParts
from biped.robot.planar.order import Order
from biped.robot.planar.topology import BASE, KNEE, N_POINTS, PITCH, X, Z


class Planes(NamedTuple):
    """The ground below the points.

    Attributes:
        ground: (1,) `biped.robot.ground.GROUND`; where it is level, the rest is not looked at.
        geoms: (4,) numbers of the planes, by point.
        place: (ngeom, 3) [m] geoms in the world, the model's, live.
        turn: (ngeom, 4) their quaternions, likewise.
        was: (ngeom, 3) [m] geoms in the latest step, the data's, live.
        axes: (ngeom, 9) their rotations, likewise.
    """

    ground: np.ndarray
    geoms: np.ndarray
    place: np.ndarray
    turn: np.ndarray
    was: np.ndarray
    axes: np.ndarray


def planes_of(model: mujoco.MjModel, data: mujoco.MjData, robot: PlanarParts, profile: Profile) -> Planes:
    """The planes of a model that was compiled for ground like this, and is one's own unless that is level."""
    ground = np.zeros(1, GROUND)
    set_ground(ground[0], profile)
    geoms = [-1 if profile.level else model.geom(plane_below(point)).id for point in robot.points]
    return Planes(ground, np.array(geoms), model.geom_pos, model.geom_quat, data.geom_xpos, data.geom_xmat)


@kernel
def lay(planes, at, points):
    """Moves the planes below the points.

    Args:
        planes: `Planes`.
        at: (ngeom, 3) [m] where geoms are now.
        points: (4,) geoms of the points.
    """
    ground = planes.ground[0]
    for i in range(points.size):
        x, plane = at[points[i], 0], planes.geoms[i]
        rise = rise_of(ground, piece_below(ground, x))
        half = -0.5 * math.atan(rise)  # about y, which turns z towards x
        planes.place[plane, 0], planes.place[plane, 2] = x, height_below(ground, x)
        planes.turn[plane, 0], planes.turn[plane, 2] = math.cos(half), math.sin(half)


@inner_kernel
def above(planes, place, points, i):
    """Distance [m] of point i from the ground in the latest step, as MuJoCo finds it, to the last bit."""
    point = points[i]
    if planes.ground[0]["count"] == 0:
        return place[point, 2]
    plane = planes.geoms[i]
    was, axes = planes.was[plane], planes.axes[plane]
    x, y, z = place[point, 0] - was[0], place[point, 1] - was[1], place[point, 2] - was[2]
    return x * axes[2] + y * axes[5] + z * axes[8]


@inner_kernel
def turned(planes, i, line):
    """Turns the force on point i in a row of the log from the plane's directions into the slope's."""
    axes = planes.axes[planes.geoms[i]]
    c, s = axes[8], -axes[2]
    along, normal = line[FORCE + 2 * i], line[FORCE + 2 * i + 1]
    line[FORCE + 2 * i] = c * along - s * normal
    line[FORCE + 2 * i + 1] = s * along + c * normal


@inner_kernel
def log_forces(log, k, efc_force, place, points, radius, contacts, stops, bent, pyramid, planes):
    """Writes the forces of ground and knee stops in the physics step that began at row k.

    MuJoCo lists joint limits first, then the contacts that exist in pair order. An elliptic cone has three rows each:
    normal, lateral and backward; a pyramid four edges, normal ± friction · lateral, then ± backward. A limit or contact
    exists where the joint or point is beyond it (no margin).

    Args:
        log: The log.
        k: Row; its configuration is the one the step began with.
        efc_force: (nefc,) MuJoCo's constraint forces [N, N m].
        place: (ngeom, 3) [m] geom positions in that configuration.
        points: (4,) numbers of the contact points' geoms.
        radius: [m] of those geoms.
        contacts: (4,) points in the order in which MuJoCo lists contacts.
        stops: (2,) stops in the order in which MuJoCo lists joint limits.
        bent: (2,) [rad] the other ends of their ranges.
        pyramid: Coefficient of friction of a pyramidal cone; 0 for an elliptic one.
        planes: `biped.engines.planar.ground.Planes`, of the same step.
    """
    rows = 4 if pyramid > 0.0 else 3
    touching = 0
    for i in range(points.size):
        if above(planes, place, points, i) < radius:
            touching += 1
    at = efc_force.size - rows * touching
    limit = 0
    for leg in stops:
        log[k, STOP + leg] = 0.0
        angle = log[k, Q + KNEE[leg]]
        if limit < at and not bent[leg] <= angle <= 0.0:
            log[k, STOP + leg] = -efc_force[limit] if angle > 0.0 else efc_force[limit]
            limit += 1
    for i in contacts:
        log[k, FORCE + 2 * i] = 0.0
        log[k, FORCE + 2 * i + 1] = 0.0
        if at >= 0 and above(planes, place, points, i) < radius:
            if pyramid > 0.0:
                log[k, FORCE + 2 * i] = -pyramid * (efc_force[at + 2] - efc_force[at + 3])
                log[k, FORCE + 2 * i + 1] = efc_force[at] + efc_force[at + 1] + efc_force[at + 2] + efc_force[at + 3]
            else:
                log[k, FORCE + 2 * i] = -efc_force[at + 2]
                log[k, FORCE + 2 * i + 1] = efc_force[at]
            at += rows
            if planes.ground[0]["count"] > 0:
                turned(planes, i, log[k])


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
        efc_force: (nefc,) MuJoCo's constraint forces [N, N m], as of `biped.engines.planar.ground.log_forces`.
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
