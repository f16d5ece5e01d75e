"""What the controller senses: link angles, toe and heel heights, and contacts that are believed only after a while."""

from __future__ import annotations

import math

from biped.base.jit import kernel


@kernel
def sense_links(c, J, q, v):
    """Fills angles, rates, joint positions and contact points of the record from Pinocchio's Jacobian.

    A hinge about -y at (x, z) has the world-frame column J[0] = z, J[2] = -x, so the columns *are* the joint positions.

    Args:
        c: Controller record (`biped.control.record.CONTROL`).
        J: (6, 9) world-frame joint Jacobian.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities [m/s, rad/s].
    """
    angle, rate, joint, position, height = c["angle"], c["rate"], c["joint"], c["position"], c["height"]
    point = c["point"]
    for link in range(7):
        up = link - 1 if link != 4 else 0
        angle[link] = q[link + 2] + (angle[up] if link > 0 else 0.0)
        rate[link] = v[link + 2] + (rate[up] if link > 0 else 0.0)
        joint[link, 0] = -J[2, link + 2]
        joint[link, 1] = J[0, link + 2]
    for i in range(4):
        foot = 3 if i < 2 else 6
        cos, sin = math.cos(angle[foot]), math.sin(angle[foot])
        position[i, 0] = joint[foot, 0] + cos * point[i, 0] - sin * point[i, 1]
        position[i, 1] = joint[foot, 1] + sin * point[i, 0] + cos * point[i, 1]
        height[i] = position[i, 1]


@kernel
def believe_contacts(c):
    """Updates the believed contacts from the heights: a change must last its hold time before it counts.

    Points alternate toe, heel; hold is heel on, heel off, toe on, toe off, in ticks.
    """
    believed, waiting, hold = c["believed"], c["waiting"], c["hold"]
    for i in range(4):
        touching = 1 if c["height"][i] < c["contact_height"] else 0
        if touching == believed[i]:
            waiting[i] = 0
            continue
        waiting[i] += 1
        which = (0 if i % 2 == 1 else 2) + (0 if touching else 1)
        if waiting[i] >= hold[which]:
            believed[i] = touching
            waiting[i] = 0


@kernel
def first_belief(c):
    """At the start of a run what touches is believed at once."""
    for i in range(4):
        c["believed"][i] = 1 if c["height"][i] < c["contact_height"] else 0
        c["waiting"][i] = 0
