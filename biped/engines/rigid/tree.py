"""Kinematics, mass matrix and bias forces of the planar tree, compiled: the same numbers as Pinocchio's.

Ten seconds of walking take 40 000 evaluations; at the price of Pinocchio's calls from Python they would take longer
than everything else together. In a plane, subtree sums about the torso's centre of mass suffice: with mass m, first
moment S and second moment T of the subtree that hinge j carries, and hinges at p, for i above or equal to j

    M_ij = T_j - S_j·(p_i + p_j) + m_j p_i·p_j

Coordinates and signs as in `biped.robot.tree`.
"""

from __future__ import annotations

from biped.base.jit import kernel
from biped.control.bias import bias_forces, carry


@kernel
def place(w, q, v):
    """Fills angles, rates, places and velocity-product accelerations J̇v of joints, centres of mass and points."""
    angle, rate, joint, com, point = w["angle"], w["rate"], w["joint"], w["com"], w["point"]
    joint_bias, com_bias, point_bias = w["joint_bias"], w["com_bias"], w["point_bias"]
    offset, centre, foot = w["offset"], w["centre"], w["foot"]
    for k in range(7):
        up = 0 if k == 4 else k - 1
        if k == 0:
            angle[k], rate[k] = q[2], v[2]
            for axis in range(2):
                joint[k, axis] = 0.0
                joint_bias[k, axis] = 0.0
        else:
            angle[k], rate[k] = angle[up] + q[k + 2], rate[up] + v[k + 2]
            carry(angle[up], rate[up], joint[up], joint_bias[up], offset[k], joint[k], joint_bias[k])
        carry(angle[k], rate[k], joint[k], joint_bias[k], centre[k], com[k], com_bias[k])
    for i in range(4):
        k = 3 if i < 2 else 6
        carry(angle[k], rate[k], joint[k], joint_bias[k], foot[i], point[i], point_bias[i])


@kernel
def mass_and_bias(w):
    """Fills M (9, 9), upper triangle, and h (9,), gravity included, for the configuration that `place` left."""
    M, joint, com, mass = w["M"], w["joint"], w["com"], w["mass"]
    bias_forces(joint, com, w["com_bias"], mass, w["gravity"], w["h"])
    below_m, below_x, below_z, below_t = 0.0, 0.0, 0.0, 0.0  # what hangs on the link: mass, S, T
    torso_m, torso_x, torso_z, torso_t = 0.0, 0.0, 0.0, 0.0
    for i in range(9):
        for j in range(i, 9):
            M[i, j] = 0.0
    for k in (3, 2, 1, 6, 5, 4, 0):
        if k in (3, 6):
            below_m, below_x, below_z, below_t = 0.0, 0.0, 0.0, 0.0
        elif k == 0:
            below_m, below_x, below_z, below_t = torso_m, torso_x, torso_z, torso_t
        x, z = com[k, 0], com[k, 1]
        below_m += mass[k]
        below_x += mass[k] * x
        below_z += mass[k] * z
        below_t += mass[k] * (x * x + z * z) + w["inertia"][k]
        px, pz = joint[k, 0], joint[k, 1]
        j = k + 2
        M[0, j] = below_m * pz - below_z
        M[1, j] = below_x - below_m * px
        i = k
        while True:
            ix, iz = joint[i, 0], joint[i, 1]
            M[i + 2, j] = below_t - below_x * (ix + px) - below_z * (iz + pz) + below_m * (ix * px + iz * pz)
            if i == 0:
                break
            i = 0 if i in (1, 4) else i - 1
        if k in (1, 4):
            torso_m += below_m
            torso_x += below_x
            torso_z += below_z
            torso_t += below_t
    M[0, 0] = below_m
    M[1, 1] = below_m
    for i in range(6):
        M[3 + i, 3 + i] += w["armature"][i]


@kernel
def applied_forces(w, v):
    """Fills the generalized forces (9,) of actuators, dampers and pushes; a push acts at its link's centre of mass."""
    force, joint, com = w["force"], w["joint"], w["com"]
    for j in range(9):
        force[j] = w["Q"][j]
    for i in range(6):
        force[3 + i] -= w["damping"][i] * v[3 + i]
    if w["pushed"] == 0:
        return
    for k in range(7):
        fx, fz = w["push"][k, 0], w["push"][k, 1]
        force[0] += fx
        force[1] += fz
        i = k
        while True:
            force[i + 2] += (com[k, 0] - joint[i, 0]) * fz - (com[k, 1] - joint[i, 1]) * fx
            if i == 0:
                break
            i = 0 if i in (1, 4) else i - 1


@kernel
def point_row(w, i, direction, a):
    """Writes the row a (9,) of point i: the velocity of its height (direction 0) or of its place along the ground."""
    joint, x, z = w["joint"], w["point"][i, 0], w["point"][i, 1]
    for j in range(9):
        a[j] = 0.0
    a[1 - direction] = 1.0
    leg = i // 2
    for step in range(4):
        k = 0 if step == 0 else 3 * leg + step
        a[k + 2] = x - joint[k, 0] if direction == 0 else joint[k, 1] - z
