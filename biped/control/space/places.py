"""Where the walker is: link angles, contact points with their Jacobians, and the mass matrix by blocks.

Everything follows from what an engine computes anyway in order to step (MuJoCo's spatial axes about the centre of mass,
"com-based"): nothing is computed twice.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.control.space.topology import (
    BASE,
    FOOT,
    HEEL_END,
    LEG,
    LEG_POINTS,
    LEGS,
    N_POINTS,
    SIDE,
    THIGH,
    TORSO,
)  # fmt: skip
from biped.numerics.lanes import LANES


class Mechanics(NamedTuple):
    """A biped's state and what an engine knows of it, live arrays.

    Attributes:
        q: (19,) MuJoCo's coordinates: place [m], orientation, joints [rad].
        v: (18,) velocities.
        M: (135,) mass matrix: rows up to the diagonal, of columns that a row's body hangs on.
        h: (18,) bias forces with gravity.
        axes: (18, 6) world-frame axis and, at the centre of mass, linear velocity of each coordinate.
        axes_rate: (18, 6) their rates.
        twist: (8, 6) angular velocity and linear velocity at the centre of mass of each body, the world first.
        com: (8, 3) centre of mass of each body with all that hangs on it.
        turned: (8, 9) orientation of each body.
        place: (ngeom, 3) geoms.
        points: (8,) geoms that are contact points.
    """

    q: np.ndarray
    v: np.ndarray
    M: np.ndarray
    h: np.ndarray
    axes: np.ndarray
    axes_rate: np.ndarray
    twist: np.ndarray
    com: np.ndarray
    turned: np.ndarray
    place: np.ndarray
    points: np.ndarray


@inner_kernel
def mass_blocks(c, m):
    """Fills the blocks of M: base, legs, and legs with base; both triangles."""
    at, M = c["at"], m.M
    k = 0
    for i in range(BASE):
        for j in range(i + 1):
            at["M_base"][i, j] = M[k]
            at["M_base"][j, i] = M[k]
            k += 1
    for leg in range(LEGS):
        for i in range(LEG):
            for j in range(BASE):
                at["M_cross"][leg, i, j] = M[k]
                k += 1
            for j in range(i + 1):
                at["M_leg"][leg, i, j] = M[k]
                at["M_leg"][leg, j, i] = M[k]
                k += 1


@inner_kernel
def _centre(c, m):
    """Centre of mass and, from the rows of M that push the whole walker, its velocity."""
    at = c["at"]
    for i in range(3):
        at["com"][i] = m.com[1, i]
        s = 0.0
        for j in range(BASE):
            s += at["M_base"][i, j] * m.v[j]
        for leg in range(LEGS):
            for j in range(LEG):
                s += at["M_cross"][leg, j, i] * m.v[BASE + LEG * leg + j]
        at["com_velocity"][i] = s / c["belief"]["mass"]


@inner_kernel
def _angles(c, m):
    """Angles and rates of torso and thighs against the inertial frame, turned to the heading asked for."""
    at, tilt = c["at"], c["belief"]["tilt"]
    cos, sin = math.cos(c["gait"]["heading"]), math.sin(c["gait"]["heading"])
    for link in range(1 + LEGS):
        body = 1 + (TORSO if link == 0 else THIGH[link - 1])
        R, w = m.turned[body], m.twist[body]
        ahead, left = R[2] * cos + R[5] * sin, R[5] * cos - R[2] * sin  # of the link's own axis
        sagittal = math.atan2(R[8], ahead) + tilt[0]
        frontal = math.atan2(-left, R[8]) + tilt[1]
        pitching, rolling = w[0] * sin - w[1] * cos, w[0] * cos + w[1] * sin
        turning = w[0] * R[2] + w[1] * R[5] + w[2] * R[8]
        yaw = math.atan2(-(R[1] * cos + R[4] * sin), R[4] * cos - R[1] * sin)  # of its transverse axis
        if link == 0:
            at["torso"][0], at["torso"][1], at["torso"][2] = sagittal, frontal, yaw
            at["torso_rate"][0], at["torso_rate"][1], at["torso_rate"][2] = pitching, rolling, turning
        else:
            leg = link - 1
            side = SIDE[leg]
            at["angle"][leg, 0], at["angle"][leg, 1], at["angle"][leg, 2] = sagittal, side * frontal, side * yaw
            at["rate"][leg, 0], at["rate"][leg, 1], at["rate"][leg, 2] = pitching, side * rolling, side * turning


@inner_kernel
def heights(c, m):
    """Fills the heights of the contact points and the feet's middles."""
    at = c["at"]
    for leg in range(LEGS):
        for i in range(3):
            s = 0.0
            for p in range(LEG_POINTS):
                s += m.place[m.points[LEG_POINTS * leg + p], i]
            at["foot"][leg, i] = s / LEG_POINTS
    for p in range(N_POINTS):
        at["height"][p] = m.place[m.points[p], 2]


@inner_kernel
def point_motion(c, m):
    """Fills what moves the contact points: Jacobians by column, J̇v, and how fast they rise."""
    at, A = c["at"], c["at"]["A"]
    x, y, z = m.com[1, 0], m.com[1, 1], m.com[1, 2]
    for leg in range(LEGS):
        body = 1 + FOOT[leg]
        rx, ry, rz, lx, ly, lz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # the foot's acceleration without any of the coordinates'
        for i in range(BASE + LEG):
            j = i if i < BASE else LEG * leg + i
            rate, v = m.axes_rate[j], m.v[j]
            rx += rate[0] * v
            ry += rate[1] * v
            rz += rate[2] * v
            lx += rate[3] * v
            ly += rate[4] * v
            lz += rate[5] * v
        w = m.twist[body]
        for p in range(LEG_POINTS):
            geom = m.points[LEG_POINTS * leg + p]
            px, py, pz = m.place[geom, 0] - x, m.place[geom, 1] - y, m.place[geom, 2] - z
            up = LANES * leg + 3 * p
            for i in range(BASE + LEG):
                axis = m.axes[i if i < BASE else LEG * leg + i]
                A[i, up] = axis[5] + axis[0] * py - axis[1] * px
                A[i, up + 1] = axis[3] + axis[1] * pz - axis[2] * py
                A[i, up + 2] = axis[4] + axis[2] * px - axis[0] * pz
            vx = w[3] + w[1] * pz - w[2] * py
            vy = w[4] + w[2] * px - w[0] * pz
            vz = w[5] + w[0] * py - w[1] * px
            k = LEG_POINTS * leg + p
            at["speed"][k] = vz
            at["bias"][k, 0] = lz + rx * py - ry * px + w[0] * vy - w[1] * vx
            at["bias"][k, 1] = lx + ry * pz - rz * py + w[1] * vz - w[2] * vy
            at["bias"][k, 2] = ly + rz * px - rx * pz + w[2] * vx - w[0] * vz


@inner_kernel
def sense_places(c, m):
    """Fills what leg states and Q_d are decided on."""
    mass_blocks(c, m)
    _centre(c, m)
    _angles(c, m)
    heights(c, m)


@kernel
def believe_contacts(c, first):
    """Updates which ends of the feet are believed to touch, as in `biped.control.planar.sensing`, at once at first."""
    memory, sensing, height = c["memory"], c["sensing"], c["at"]["height"]
    believed, waiting = memory["believed"], memory["waiting"]
    for end in range(2 * LEGS):
        lower = min(height[2 * end], height[2 * end + 1])
        touching = 1 if lower < sensing["contact_height"] else 0
        if first or touching == believed[end]:
            believed[end] = touching
            waiting[end] = 0
            continue
        waiting[end] += 1
        which = (0 if end % 2 == HEEL_END else 2) + (0 if touching else 1)
        if waiting[end] >= sensing["hold"][which]:
            believed[end] = touching
            waiting[end] = 0
