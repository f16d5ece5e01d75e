"""The leg that hangs on the bench, with its own gears or others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from biped.dynamics.mechanisms.leg import LINKS, Leg
from biped.robot.topology import FOOT, SHANK, THIGH
from biped.robot.tree import Tree

GEARS = (21.0, 12.0, 21.0)
"""Of hip, knee and ankle (Table 4.1)."""
HIGH = (105.0, 60.0, 105.0)
"""The usual highly geared joints of Fig 4.7, dotted."""
FRICTION = 4.1e-3
"""[N m] of the motor's brushes and bearings: its no-load current of 0.137 A times 30.2 mN m/A."""
STEP = 1.0 / 600.0
"""[s] between samples, of which the periods of Fig 4.8 are whole numbers."""


class Reading(NamedTuple):
    """A way to read what a gear does to a joint.

    Attributes:
        name: In words.
        gears: Of hip, knee and ankle.
        squared: Whether damping grows with the square of the gear, as friction on the motor's side does; else it is
            the joint's own, whatever the gear.
        coulomb: Whether the motors' dry friction acts.
    """

    name: str
    gears: tuple[float, float, float]
    squared: bool = False
    coulomb: bool = False


READINGS = (
    Reading("21/12, as built", GEARS),
    Reading("21/12, dry friction of the motors too", GEARS, coulomb=True),
    Reading("105/60, damping of the joint", HIGH),
    Reading("105/60, damping with n²", HIGH, squared=True),
)


def leg_of(tree: Tree, reading: Reading = READINGS[0]) -> Leg:
    """The right leg of a robot with other gears than its own."""
    links = [THIGH[0], SHANK[0], FOOT[0]]
    ratio = (np.array(reading.gears) / GEARS) ** 2
    hinge = np.zeros((LINKS, 2))
    hinge[:2] = tree.joint[links[1:]]
    own = slice(0, LINKS)
    return Leg(
        mass=tree.mass[links],
        inertia=tree.inertia[links],
        com=tree.com[links],
        joint=hinge,
        armature=tree.armature[own] * ratio,
        damping=tree.damping[own] * (ratio if reading.squared else 1.0),
        coulomb=FRICTION * np.array(reading.gears) * (1.0 if reading.coulomb else 0.0),
    )


def relative(q: np.ndarray) -> np.ndarray:
    """(n, 3) [rad] joint angles of absolute ones q (n, 3)."""
    return np.column_stack([q[:, 0], np.diff(q, axis=1)])
