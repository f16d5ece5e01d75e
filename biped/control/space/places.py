"""Where the walker is: link angles, contact points with their Jacobians, and the mass matrix by blocks.

Everything follows from what an engine computes anyway in order to step (MuJoCo's spatial axes about the centre of mass,
"com-based"): nothing is computed twice.
"""

import math
from typing import NamedTuple

import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.control.space.record import BASE, HEEL_END, HIP_JOINTS, LEG, LEG_POINTS, LEGS, N_POINTS, SIDE
from biped.numerics.lanes import LANES


class Mechanics(NamedTuple):
    """A biped's state and what an engine knows of it, live arrays in the engine's order.

    Attributes:
        q: (nq,) MuJoCo's coordinates: place [m], orientation, joints [rad].
        v: (nv,) velocities.
        M: (nM,) mass matrix: rows up to the diagonal, of columns that a row's body hangs on.
        entries: (nM, 4) where each of these belongs: to the base (0), across (1), to a leg (2) or nowhere (-1);
            which leg; row; column.
        h: (nv,) bias forces with gravity.
        axes: (nv, 6) world-frame axis and, at the centre of mass, linear velocity of each coordinate.
        axes_rate: (nv, 6) their rates.
        twist: (nbody, 6) angular velocity and linear velocity at the centre of mass of each body, the world first.
        com: (nbody, 3) centre of mass of each body with all that hangs on it.
        turned: (nbody, 9) orientation of each body.
        origin: (nbody, 3) [m] its origin.
    """

    q: np.ndarray
    v: np.ndarray
    M: np.ndarray
    entries: np.ndarray
    h: np.ndarray
    axes: np.ndarray
    axes_rate: np.ndarray
    twist: np.ndarray
    com: np.ndarray
    turned: np.ndarray
    origin: np.ndarray


@inner_kernel
def mass_blocks(c, m):
    """Fills the blocks of M: base with the joints above the legs, legs, and legs with it; both triangles."""
    at, M, entries = c["at"], m.M, m.entries
    base, cross, legs = at["M_base"], at["M_cross"], at["M_leg"]
    for k in range(M.size):
        block, leg, i, j = entries[k, 0], entries[k, 1], entries[k, 2], entries[k, 3]
        if block == 0:
            base[i, j] = M[k]
            base[j, i] = M[k]
        elif block == 1:
            cross[leg, i, j] = M[k]
        elif block == 2:
            legs[leg, i, j] = M[k]
            legs[leg, j, i] = M[k]


@inner_kernel
def _centre(c, m):
    """Centre of mass and, from the rows of M that push the whole walker, its velocity."""
    at = c["at"]
    v, upper, reach = at["v"], at["M_base"].shape[0], at["M_cross"].shape[2]
    for i in range(3):
        at["com"][i] = m.com[c["belief"]["root"], i]
        s = 0.0
        for j in range(upper):
            s += at["M_base"][upper - BASE + i, j] * v[j]
        for leg in range(LEGS):
            for j in range(LEG):
                s += at["M_cross"][leg, j, reach - BASE + i] * v[upper + LEG * leg + j]
        at["com_velocity"][i] = s / c["belief"]["mass"]


@inner_kernel
def _coordinates(c, m):
    """Velocities in the law's order, and angles of knees, ankles and inversion with their rates."""
    at, belief = c["at"], c["belief"]
    upper = at["M_base"].shape[0]
    for j in range(at["v"].size):
        at["v"][j] = m.v[belief["column"][j]] if belief["column"][j] >= 0 else 0.0
    for leg in range(LEGS):
        for i in range(HIP_JOINTS, LEG):
            j = upper + LEG * leg + i
            sign = belief["sign"][leg, i]
            if belief["place"][j] >= 0:
                at["joint"][leg, i] = sign * (m.q[belief["place"][j]] - belief["zero"][leg, i])
            at["joint_rate"][leg, i] = sign * at["v"][j]


@inner_kernel
def _in_world(R, own, out):
    """Writes a direction (3,) in a body's frame as the world has it."""
    for i in range(3):
        out[i] = R[3 * i] * own[0] + R[3 * i + 1] * own[1] + R[3 * i + 2] * own[2]


@inner_kernel
def _angles(c, m):
    """Angles and rates of torso and thighs against the inertial frame, turned to the heading asked for."""
    at, belief, tilt = c["at"], c["belief"], c["belief"]["tilt"]
    cos, sin = math.cos(c["gait"]["heading"]), math.sin(c["gait"]["heading"])
    for link in range(1 + LEGS):
        R, w = m.turned[belief["link"][link]], m.twist[belief["link"][link]]
        own, side_on = at["axis"][link], belief["across"][link]
        _in_world(R, belief["along"][link], own)
        across_x = R[0] * side_on[0] + R[1] * side_on[1] + R[2] * side_on[2]
        across_y = R[3] * side_on[0] + R[4] * side_on[1] + R[5] * side_on[2]
        ahead, left = own[0] * cos + own[1] * sin, own[1] * cos - own[0] * sin  # of the link's own axis
        sagittal = math.atan2(own[2], ahead) + tilt[0]
        frontal = math.atan2(-left, own[2]) + tilt[1]
        pitching, rolling = w[0] * sin - w[1] * cos, w[0] * cos + w[1] * sin
        turning = w[0] * own[0] + w[1] * own[1] + w[2] * own[2]
        yaw = math.atan2(-(across_x * cos + across_y * sin), across_y * cos - across_x * sin)
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
    """Fills places and heights of the contact points, and the feet's middles."""
    at, belief = c["at"], c["belief"]
    for p in range(N_POINTS):
        body = belief["foot"][p // LEG_POINTS]
        place = at["place"][p]
        _in_world(m.turned[body], belief["sole"][p], place)
        for i in range(3):
            place[i] += m.origin[body, i]
        at["height"][p] = place[2]
    for leg in range(LEGS):
        for i in range(3):
            s = 0.0
            for p in range(LEG_POINTS):
                s += at["place"][LEG_POINTS * leg + p, i]
            at["foot"][leg, i] = s / LEG_POINTS


@inner_kernel
def point_motion(c, m):
    """Fills what moves the contact points: Jacobians by column, J̇v, and how fast they rise."""
    at, A, column = c["at"], c["at"]["A"], c["belief"]["column"]
    upper, reach = at["M_base"].shape[0], at["M_cross"].shape[2]
    root = m.com[c["belief"]["root"]]
    x, y, z = root[0], root[1], root[2]
    for leg in range(LEGS):
        rx, ry, rz, lx, ly, lz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # the foot's acceleration without any of the coordinates'
        for i in range(reach + LEG):
            j = upper - reach + i if i < reach else upper + LEG * leg + i - reach
            if column[j] < 0:
                continue
            rate, v = m.axes_rate[column[j]], at["v"][j]
            rx += rate[0] * v
            ry += rate[1] * v
            rz += rate[2] * v
            lx += rate[3] * v
            ly += rate[4] * v
            lz += rate[5] * v
        w = m.twist[c["belief"]["foot"][leg]]
        for p in range(LEG_POINTS):
            place = at["place"][LEG_POINTS * leg + p]
            px, py, pz = place[0] - x, place[1] - y, place[2] - z
            up = LANES * leg + 3 * p
            for i in range(reach + LEG):
                j = upper - reach + i if i < reach else upper + LEG * leg + i - reach
                if column[j] < 0:
                    continue
                axis = m.axes[column[j]]
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
def headed(c, x, y):
    """(2,) a horizontal vector of the ground's frame, ahead and to the left of where the walker is told to go."""
    cos, sin = math.cos(c["gait"]["heading"]), math.sin(c["gait"]["heading"])
    return x * cos + y * sin, y * cos - x * sin


@inner_kernel
def sense_places(c, m):
    """Fills what leg states and Q_d are decided on."""
    mass_blocks(c, m)
    _coordinates(c, m)
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
