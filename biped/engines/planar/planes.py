"""Ground that is not level, in MuJoCo: a plane for each contact point, laid along the piece of ground below it.

Planes belong to the world; before every physics step they are moved to where the points then are, so that a point meets
exactly the line of `biped.robot.ground`, whose corners no shape of MuJoCo's has without faces and edges of its own that
a sinking point would be pushed out of sideways. Level ground is the model file's plane, and nothing is moved.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.measure.columns import FORCE
from biped.robot.ground import GROUND, Profile, height_below, piece_below, rise_of, set_ground
from biped.robot.planar.build import plane_below
from biped.robot.planar.description import PlanarParts


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
