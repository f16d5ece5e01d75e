"""The planar tree at the record's configuration: places, mass matrix, bias and applied forces.

Ten seconds of walking take 40 000 evaluations; at the price of Pinocchio's calls from Python they would take longer
than everything else together. Places count from the torso's centre of mass, so that they lose no digits far along the
road.
"""

from biped.base.jit import kernel
from biped.robot.planar.kinematics import add_force, bias_forces, forward, mass_matrix
from biped.robot.planar.topology import BASE, N_LINKS, NQ, NU


@kernel
def place(w, q, v):
    """Fills angles, rates, places, velocities and velocity-product accelerations J̇v."""
    forward(w["tree"], q, v, 0.0, 0.0, w["at"])


@kernel
def mass_and_bias(w):
    """Fills M (9, 9), upper triangle, and h (9,), gravity included, for the configuration that `place` left."""
    bias_forces(w["tree"], w["at"], w["gravity"], w["system"]["h"])
    mass_matrix(w["tree"], w["at"], w["system"]["M"])


@kernel
def applied_forces(w, v):
    """Fills the generalized forces (9,) of actuators, dampers and pushes; a push acts at its link's centre of mass."""
    force, acting = w["system"]["force"], w["acting"]
    for j in range(NQ):
        force[j] = acting["Q"][j]
    for i in range(NU):
        force[BASE + i] -= w["tree"]["damping"][i] * v[BASE + i]
    if acting["pushed"] == 0:
        return
    for k in range(N_LINKS):
        add_force(w["at"], k, acting["push"][k, 0], acting["push"][k, 1], force)
