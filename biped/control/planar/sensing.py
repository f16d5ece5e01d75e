"""The controller's sensing: link angles, toe and heel heights, and contacts that are believed only after a while."""

from biped.base.jit import inner_kernel, kernel
from biped.robot.ground import height_below
from biped.robot.planar.kinematics import biases_on_links, forward, link_angles, points_on_links
from biped.robot.planar.topology import HEEL, LINK_DOF, N_LINKS, N_POINTS, NQ, X, Z


@inner_kernel
def sense_links(c, q, v):
    """Fills the record's places, counted from the torso's origin, and the heights of the points.

    Args:
        c: Controller record (`biped.control.planar.setup.CONTROL`).
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities [m/s, rad/s].
    """
    forward(c["tree"], q, v, 0.0, 0.0, c["at"])
    _heights(c, q)


@kernel
def sense_links_in(c, J, q, v):
    """As `sense_links`, from Pinocchio's world-frame joint Jacobian J (6, 9) instead of the tree's lengths.

    A hinge about -y at (x, z) has the world-frame column J[0] = z, J[2] = -x, so the columns *are* the joint positions.
    """
    at = c["at"]
    link_angles(q, v, at)
    for link in range(N_LINKS):
        at["joint"][link, 0] = -J[2, link + LINK_DOF] - q[X]
        at["joint"][link, 1] = J[0, link + LINK_DOF] - q[Z]
    points_on_links(c["tree"], at)
    biases_on_links(c["tree"], at)
    _heights(c, q)


@kernel
def sense_motion_in(c, h, bias):
    """Fills bias forces and the points' J̇v from Pinocchio's h (9,) and (4, 3) [m/s²] along the world's axes."""
    tick, point_bias = c["tick"], c["at"]["point_bias"]
    tick["given"] = 1
    for j in range(NQ):
        tick["h"][j] = h[j]
    for i in range(N_POINTS):
        point_bias[i, 0], point_bias[i, 1] = bias[i, 0], bias[i, 2]


@inner_kernel
def _heights(c, q):
    height, switches, point = c["tick"]["height"], c["switches"], c["at"]["point"]
    for i in range(N_POINTS):
        height[i] = q[Z] + point[i, 1]
        if c["ground"]["count"] > 0:
            height[i] -= height_below(c["ground"], q[X] + point[i, 0])
        if switches["believed"]:
            height[i] -= switches["under"][i]
        if switches["on"]:  # a point that presses is on the ground, one that does not is above it
            height[i] = 0.0 if switches["touching"][i] else max(height[i], c["sensing"]["contact_height"])


@kernel
def believe_contacts(c):
    """Updates the believed contacts from the heights: a change must last its hold time before it counts.

    Points alternate toe, heel; hold is heel on, heel off, toe on, toe off, in ticks.
    """
    memory, sensing = c["memory"], c["sensing"]
    believed, waiting, hold = memory["believed"], memory["waiting"], sensing["hold"]
    for i in range(N_POINTS):
        touching = 1 if c["tick"]["height"][i] < sensing["contact_height"] else 0
        if touching == believed[i]:
            waiting[i] = 0
            continue
        waiting[i] += 1
        which = (0 if i in HEEL else 2) + (0 if touching else 1)
        if waiting[i] >= hold[which]:
            believed[i] = touching
            waiting[i] = 0


@kernel
def first_belief(c):
    """At the start of a run what touches is believed at once."""
    memory = c["memory"]
    for i in range(N_POINTS):
        memory["believed"][i] = 1 if c["tick"]["height"][i] < c["sensing"]["contact_height"] else 0
        memory["waiting"][i] = 0
