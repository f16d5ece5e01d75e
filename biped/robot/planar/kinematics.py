"""The planar tree, compiled once for all: places, velocities, velocity products, bias forces, mass matrix and rows.

In a plane links have no gyroscopic moment, so subtree sums are all there is to it. The bias of a hinge is the moment
about it of its subtree's forces m (J̇v - g). With mass m, first moment S and second moment T about the torso's origin of
the subtree that hinge j carries, and hinges at p, for i above or equal to j

    M_ij = T_j - S_j·(p_i + p_j) + m_j p_i·p_j

The numbers are Pinocchio's at a tenth of the price; the controller asks Pinocchio at every model whether they are
(`biped.control.planar.controller`), and the tests hold both together. Coordinates and order as in
`biped.robot.planar.topology`; vectors (x, z), angles counter-clockwise.
"""

import numpy as np

from biped.base.jit import inner_kernel, kernel
from biped.numerics.lanes import sines
from biped.robot.planar.topology import (
    BASE,
    CHAINS,
    FOOT,
    INWARD,
    LINK_DOF,
    N_LINKS,
    N_POINTS,
    NQ,
    NU,
    PARENT,
    PITCH,
    POINT_LEG,
    POINT_LINK,
    THIGH,
    TORSO,
    X,
    Z,
)

TREE = np.dtype(
    [
        ("joint", "f8", (N_LINKS, 2)),  # m, of each link's joint in its parent's frame
        ("com", "f8", (N_LINKS, 2)),  # m, in the link's frame
        ("mass", "f8", N_LINKS),  # kg
        ("inertia", "f8", N_LINKS),  # kg m², about the centre of mass
        ("armature", "f8", NU),  # kg m²
        ("damping", "f8", NU),  # N m s/rad
        ("point", "f8", (N_POINTS, 2)),  # m, in the foot's frame
    ],
    align=True,
)
"""`biped.robot.planar.tree.Tree` as kernels read it."""

PLACES = np.dtype(
    [
        ("angle", "f8", N_LINKS), ("rate", "f8", N_LINKS),  # rad, rad/s, of the links
        ("sin", "f8", N_LINKS), ("cos", "f8", N_LINKS),  # of the angles
        ("joint", "f8", (N_LINKS, 2)), ("com", "f8", (N_LINKS, 2)), ("point", "f8", (N_POINTS, 2)),  # m
        ("joint_velocity", "f8", (N_LINKS, 2)), ("com_velocity", "f8", (N_LINKS, 2)),  # m/s
        ("point_velocity", "f8", (N_POINTS, 2)),
        ("joint_bias", "f8", (N_LINKS, 2)), ("com_bias", "f8", (N_LINKS, 2)),  # m/s², velocity products J̇v
        ("point_bias", "f8", (N_POINTS, 2)),
    ],
    align=True,
)  # fmt: skip
"""Where everything is and how it moves; places count from wherever the torso's was said to be."""


@inner_kernel
def link_angles(q, v, at):
    """Fills the links' absolute angles, with their sines and cosines, and rates."""
    angle, rate = at["angle"], at["rate"]
    for k in range(N_LINKS):
        if k == TORSO:
            angle[k], rate[k] = q[PITCH], v[PITCH]
        else:
            up = PARENT[k]
            angle[k], rate[k] = angle[up] + q[k + LINK_DOF], rate[up] + v[k + LINK_DOF]
    sines(angle, N_LINKS, at["sin"], at["cos"])


@kernel
def _ride(cos, sin, rate, place, velocity, bias, offset, out, out_velocity, out_bias):
    """Place, velocity and J̇v of a point fixed to a link, from those of the link's joint; offset in the link's frame."""
    x = cos * offset[0] - sin * offset[1]
    z = sin * offset[0] + cos * offset[1]
    out[0] = place[0] + x
    out[1] = place[1] + z
    out_velocity[0] = velocity[0] - z * rate
    out_velocity[1] = velocity[1] + x * rate
    out_bias[0] = bias[0] - rate * rate * x
    out_bias[1] = bias[1] - rate * rate * z


@inner_kernel
def forward(tree, q, v, x, z, at):
    """Forward kinematics of one configuration.

    Args:
        tree: `TREE` record.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities [m/s, rad/s].
        x: [m] where the torso's origin counts as being, so that places need not lose digits far along the road.
        z: [m].
        at: `PLACES` record, filled.
    """
    link_angles(q, v, at)
    cos, sin, rate = at["cos"], at["sin"], at["rate"]
    joint, velocity, bias = at["joint"], at["joint_velocity"], at["joint_bias"]
    com, com_velocity, com_bias = at["com"], at["com_velocity"], at["com_bias"]
    point, point_velocity, point_bias = at["point"], at["point_velocity"], at["point_bias"]
    for k in range(N_LINKS):
        if k == TORSO:
            joint[k, 0], joint[k, 1] = x, z
            velocity[k, 0], velocity[k, 1] = v[X], v[Z]
            bias[k, 0], bias[k, 1] = 0.0, 0.0
        else:
            up = PARENT[k]
            _ride(
                cos[up], sin[up], rate[up], joint[up], velocity[up], bias[up], tree["joint"][k],
                joint[k], velocity[k], bias[k],
            )  # fmt: skip
        _ride(
            cos[k], sin[k], rate[k], joint[k], velocity[k], bias[k], tree["com"][k],
            com[k], com_velocity[k], com_bias[k],
        )  # fmt: skip
    for i in range(N_POINTS):
        k = POINT_LINK[i]
        _ride(
            cos[k], sin[k], rate[k], joint[k], velocity[k], bias[k], tree["point"][i],
            point[i], point_velocity[i], point_bias[i],
        )  # fmt: skip


@kernel
def points_on_links(tree, at):
    """Fills the contact points' places from angles and joints that are known (the controller's, from Pinocchio)."""
    for i in range(N_POINTS):
        k = POINT_LINK[i]
        cos, sin = at["cos"][k], at["sin"][k]
        x, z = tree["point"][i, 0], tree["point"][i, 1]
        at["point"][i, 0] = at["joint"][k, 0] + cos * x - sin * z
        at["point"][i, 1] = at["joint"][k, 1] + sin * x + cos * z


@kernel
def biases_on_links(tree, at):
    """Fills centres of mass and all J̇v from rates, angles, joints and points that are known."""
    joint, bias, rate, com, com_bias = at["joint"], at["joint_bias"], at["rate"], at["com"], at["com_bias"]
    for k in range(N_LINKS):
        up = PARENT[k]
        cos, sin = at["cos"][k], at["sin"][k]
        x = cos * tree["com"][k, 0] - sin * tree["com"][k, 1]
        z = sin * tree["com"][k, 0] + cos * tree["com"][k, 1]
        for axis in range(2):
            if k == TORSO:
                bias[k, axis] = 0.0
            else:
                bias[k, axis] = bias[up, axis] - rate[up] * rate[up] * (joint[k, axis] - joint[up, axis])
            offset = x if axis == 0 else z
            com[k, axis] = joint[k, axis] + offset
            com_bias[k, axis] = bias[k, axis] - rate[k] * rate[k] * offset
    for i in range(N_POINTS):
        k = POINT_LINK[i]
        for axis in range(2):
            at["point_bias"][i, axis] = bias[k, axis] - rate[k] * rate[k] * (at["point"][i, axis] - joint[k, axis])


@inner_kernel
def speed_of_mass(tree, at, v):
    """[m/s] of the centre of mass along the ground, from angles, joints and rates that are known, and v (9,)."""
    joint, rate, speed, momentum, mass = at["joint"], at["rate"], at["joint_velocity"], 0.0, 0.0
    for k in range(N_LINKS):
        up = PARENT[k]
        speed[k, 0] = v[X] if k == TORSO else speed[up, 0] - rate[up] * (joint[k, 1] - joint[up, 1])
        z = at["sin"][k] * tree["com"][k, 0] + at["cos"][k] * tree["com"][k, 1]
        momentum += tree["mass"][k] * (speed[k, 0] - rate[k] * z)
        mass += tree["mass"][k]
    return momentum / mass


@inner_kernel
def bias_forces(tree, at, gravity, h):
    """Fills h (9,) [N, N m], gravity (2,) [m/s²] included, for the configuration that `at` holds."""
    mass, joint, com, com_bias = tree["mass"], at["joint"], at["com"], at["com_bias"]
    ox, oz = joint[TORSO, 0], joint[TORSO, 1]
    fx, fz, moment = 0.0, 0.0, 0.0  # of what hangs on the link; moments about the torso's origin
    torso_x, torso_z, torso_n = 0.0, 0.0, 0.0
    for k in INWARD:
        if k in FOOT:
            fx, fz, moment = 0.0, 0.0, 0.0
        elif k == TORSO:
            fx, fz, moment = torso_x, torso_z, torso_n
        x, z = mass[k] * (com_bias[k, 0] - gravity[0]), mass[k] * (com_bias[k, 1] - gravity[1])
        fx += x
        fz += z
        moment += (com[k, 0] - ox) * z - (com[k, 1] - oz) * x
        h[k + LINK_DOF] = moment - (joint[k, 0] - ox) * fz + (joint[k, 1] - oz) * fx
        if k in THIGH:
            torso_x += fx
            torso_z += fz
            torso_n += moment
    h[X] = fx
    h[Z] = fz


@inner_kernel
def mass_matrix(tree, at, M):
    """Fills M (9, 9), upper triangle, for the configuration that `at` holds, places counted from the torso's origin."""
    joint, com, mass = at["joint"], at["com"], tree["mass"]
    below_m, below_x, below_z, below_t = 0.0, 0.0, 0.0, 0.0  # what hangs on the link: mass, S, T
    torso_m, torso_x, torso_z, torso_t = 0.0, 0.0, 0.0, 0.0
    for i in range(NQ):
        for j in range(i, NQ):
            M[i, j] = 0.0
    for k in INWARD:
        if k in FOOT:
            below_m, below_x, below_z, below_t = 0.0, 0.0, 0.0, 0.0
        elif k == TORSO:
            below_m, below_x, below_z, below_t = torso_m, torso_x, torso_z, torso_t
        x, z = com[k, 0], com[k, 1]
        below_m += mass[k]
        below_x += mass[k] * x
        below_z += mass[k] * z
        below_t += mass[k] * (x * x + z * z) + tree["inertia"][k]
        px, pz = joint[k, 0], joint[k, 1]
        j = k + LINK_DOF
        M[X, j] = below_m * pz - below_z
        M[Z, j] = below_x - below_m * px
        i = k
        while i >= TORSO:
            ix, iz = joint[i, 0], joint[i, 1]
            M[i + LINK_DOF, j] = below_t - below_x * (ix + px) - below_z * (iz + pz) + below_m * (ix * px + iz * pz)
            i = PARENT[i]
        if k in THIGH:
            torso_m += below_m
            torso_x += below_x
            torso_z += below_z
            torso_t += below_t
    M[X, X] = below_m
    M[Z, Z] = below_m
    for i in range(NU):
        M[BASE + i, BASE + i] += tree["armature"][i]


@kernel
def add_force(at, link, fx, fz, out):
    """Adds to out (9,) the generalized forces of a force (fx, fz) [N] at a link's centre of mass."""
    out[X] += fx
    out[Z] += fz
    x, z = at["com"][link, 0], at["com"][link, 1]
    i = link
    while i >= TORSO:
        out[i + LINK_DOF] += (x - at["joint"][i, 0]) * fz - (z - at["joint"][i, 1]) * fx
        i = PARENT[i]


@kernel
def point_row(at, i, direction, a):
    """Writes the row a (9,) of point i: the velocity of its height (direction 0) or of its place along the ground."""
    joint, x, z = at["joint"], at["point"][i, 0], at["point"][i, 1]
    for j in range(NQ):
        a[j] = 0.0
    a[Z if direction == 0 else X] = 1.0
    for k in CHAINS[POINT_LEG[i]]:
        a[k + LINK_DOF] = x - joint[k, 0] if direction == 0 else joint[k, 1] - z
