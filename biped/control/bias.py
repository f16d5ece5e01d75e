"""Bias forces of the planar tree, gravity included: the same numbers as Pinocchio's, at a tenth of their price.

The bias of a hinge is the moment about it of its subtree's forces m (J̇v - g). In a plane links have no gyroscopic
moment, so subtree sums of forces and moments are all there is to it. Coordinates and signs as in `biped.robot.tree`.
"""

from __future__ import annotations

import math

from biped.base.jit import kernel


@kernel
def carry(angle, rate, origin, origin_bias, offset, out, out_bias):
    """Place and velocity-product acceleration J̇v of a point fixed to a link, from those of the link's joint.

    Args:
        angle: [rad] of the link.
        rate: [rad/s].
        origin: (2,) [m] the joint.
        origin_bias: (2,) [m/s²] its J̇v.
        offset: (2,) [m] the point in the link's frame.
        out: (2,) [m] filled with the point's place.
        out_bias: (2,) [m/s²] filled with its J̇v.
    """
    cos, sin = math.cos(angle), math.sin(angle)
    x = cos * offset[0] - sin * offset[1]
    z = sin * offset[0] + cos * offset[1]
    out[0] = origin[0] + x
    out[1] = origin[1] + z
    out_bias[0] = origin_bias[0] - rate * rate * x
    out_bias[1] = origin_bias[1] - rate * rate * z


@kernel
def bias_forces(joint, com, com_bias, mass, gravity, h):
    """Fills h (9,) [N, N m].

    Args:
        joint: (7, 2) [m] places of the links' joints; the torso's is what `h[2]` is a moment about.
        com: (7, 2) [m] centres of mass.
        com_bias: (7, 2) [m/s²] their J̇v.
        mass: (7,) [kg].
        gravity: (2,) [m/s²].
        h: Result.
    """
    ox, oz = joint[0, 0], joint[0, 1]
    fx, fz, moment = 0.0, 0.0, 0.0  # of what hangs on the link; moments about the torso's centre of mass
    torso_x, torso_z, torso_n = 0.0, 0.0, 0.0
    for k in (3, 2, 1, 6, 5, 4, 0):
        if k in (3, 6):
            fx, fz, moment = 0.0, 0.0, 0.0
        elif k == 0:
            fx, fz, moment = torso_x, torso_z, torso_n
        x, z = mass[k] * (com_bias[k, 0] - gravity[0]), mass[k] * (com_bias[k, 1] - gravity[1])
        fx += x
        fz += z
        moment += (com[k, 0] - ox) * z - (com[k, 1] - oz) * x
        h[k + 2] = moment - (joint[k, 0] - ox) * fz + (joint[k, 1] - oz) * fx
        if k in (1, 4):
            torso_x += fx
            torso_z += fz
            torso_n += moment
    h[0] = fx
    h[1] = fz


@kernel
def sensed_bias(c):
    """Fills the record's h (9,) from the links that `sense_links` left."""
    joint, bias, angle, rate = c["joint"], c["joint_bias"], c["angle"], c["rate"]
    for k in range(7):
        up = 0 if k == 4 else k - 1
        for axis in range(2):
            if k == 0:
                bias[k, axis] = 0.0
            else:
                bias[k, axis] = bias[up, axis] - rate[up] * rate[up] * (joint[k, axis] - joint[up, axis])
        carry(angle[k], rate[k], joint[k], bias[k], c["centre"][k], c["com"][k], c["com_bias"][k])
    bias_forces(joint, c["com"], c["com_bias"], c["mass"], c["gravity"], c["h"])
