"""Andrews' squeezing mechanism: seven bodies in the plane, driven by a motor against a spring, for 0.03 s.

Built from its published lengths, masses and inertias (Schiehlen (ed.), Multibody Systems Handbook, 1990; Hairer and
Wanner, Solving Ordinary Differential Equations II, VII.7), not from anyone's equations of motion. K1 is the crank at
the origin; K2 ties it to the point E; K3 is the rocker at B that the spring pulls; K4 with K5 and K6 with K7 are
two dyads from E to A. No gravity.
"""

from typing import NamedTuple

import numpy as np

from biped.dynamics.bodies import GROUND, Body, Plane

A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)  # [m]
DURATION = 0.03  # [s]

PUBLISHED = {
    "crank": 15.81077119629904,
    "rocker": 0.04082224013073101,
    "lower": 0.5244099658805304,
    "upper": 1.048080741042263,
}
"""β, γ, δ and ε at 0.03 s [rad], from the Test Set for Initial Value Problem Solvers (Bari), to its 13 digits."""


class Squeezer(NamedTuple):
    """The mechanism and the four of its bodies that turn about fixed points."""

    plane: Plane
    crank: Body  # K1, angle β
    rocker: Body  # K3, γ
    lower: Body  # K5, δ
    upper: Body  # K7, ε


def squeezer() -> Squeezer:
    """The mechanism where it starts, at rest."""
    beta, theta, gamma = -0.0617138900142764496, 0.0, 0.455279819163070380
    phi, delta, omega, epsilon = 0.222668390165885885, 0.487364979543842551, -0.222668390165885885, 1.23054744454982120
    p = Plane(gravity=(0.0, 0.0), name="squeezer")

    def turned(at, angle, local):
        c, s = np.cos(angle), np.sin(angle)
        return (at[0] + c * local[0] - s * local[1], at[1] + s * local[0] + c * local[1])

    crank = p.body("K1", mass=0.04325, inertia=2.194e-6, at=(0, 0), angle=beta, centre=(0.00092, 0))
    tip = turned((0, 0), beta, (0.007, 0))
    tie = p.body("K2", mass=0.00365, inertia=4.41e-7, at=tip, angle=beta + theta, centre=(-0.0115, 0))
    rocker = p.body("K3", mass=0.02373, inertia=5.255e-6, at=B, angle=gamma, centre=(0.01874, -0.01043))
    lower = p.body("K5", mass=0.0705, inertia=1.169e-5, at=A, angle=delta, centre=(0.02308, 0.00916))
    knee = turned(A, delta, (0.04, 0))
    first = p.body("K4", mass=0.00706, inertia=5.667e-7, at=knee, angle=phi + delta, centre=(0, -0.02 + 0.01421))
    upper = p.body("K7", mass=0.05498, inertia=1.912e-5, at=A, angle=epsilon, centre=(0.00449, -0.01228))
    elbow = turned(A, epsilon, (0, -0.04))
    second = p.body("K6", mass=0.00706, inertia=5.667e-7, at=elbow, angle=omega + epsilon, centre=(0.02 - 0.01421, 0))
    p.hinge("O", GROUND, (0, 0), crank, (0, 0))
    p.hinge("tip", crank, (0.007, 0), tie, (0, 0))
    p.hinge("B", GROUND, B, rocker, (0, 0))
    p.hinge("A lower", GROUND, A, lower, (0, 0))
    p.hinge("A upper", GROUND, A, upper, (0, 0))
    p.hinge("knee", lower, (0.04, 0), first, (0, 0))
    p.hinge("elbow", upper, (0, -0.04), second, (0, 0))
    p.hinge("E rocker", tie, (-0.028, 0), rocker, (0, -0.035))
    p.hinge("E lower", tie, (-0.028, 0), first, (0, -0.02))
    p.hinge("E upper", tie, (-0.028, 0), second, (0.02, 0))
    p.spring("spring", rocker, (0.02, -0.018), GROUND, C, stiffness=4530.0, rest=0.07785)
    p.torque("motor", crank, torque=0.033)
    return Squeezer(p, crank, rocker, lower, upper)
