"""Everything the compiled control tick of a biped with a free base reads and remembers, as one numpy record."""

from __future__ import annotations

import numpy as np

from biped.control.space.topology import BASE, ENDS, LEG, LEG_POINTS, LEGS, N_POINTS, NU, N
from biped.numerics.lanes import LANES
from biped.robot.leg_states import STATES

DIRECTIONS = 3
"""A point can be pushed up, forward and to the left."""
EDGES = 4
"""Of a point's friction pyramid: up with friction forward, backward, to the left and to the right."""
LEG_EDGES = LEG_POINTS * EDGES
N_EDGES = LEGS * LEG_EDGES
UNKNOWNS = N_EDGES + LEGS
"""Forces along all edges, and of the knees' stops."""
WIDTH = 3 * LANES
"""Lanes for the unknowns."""

GAIT = np.dtype(
    [
        ("k_torso", "f8", 3), ("b_torso", "f8", 3), ("rest_torso", "f8", 3),  # pitch, roll, yaw
        ("k", "f8", (STATES, LEG)), ("b", "f8", (STATES, LEG)), ("rest", "f8", (STATES, LEG)),
        ("position", "f8"), ("velocity", "f8"),  # of foot placement [rad/m, rad s/m]
        ("heading", "f8"),  # rad to the left, where the inertial frame's x axis is taken to point
    ],
    align=True,
)  # fmt: skip
"""The gait [rad, N m/rad, N m s/rad] by leg state; a leg's six are flexion … inversion, outward positive."""

_BELIEF = np.dtype([("tilt", "f8", 2), ("hip", "f8"), ("mass", "f8"), ("shank", "f8")], align=True)
"""[rad] pitch and roll of the ground's frame against what angles are measured from;
[m] half the distance of the hips; [kg]; [m] length of a shank."""

_SENSING = np.dtype(
    [
        ("contact_height", "f8"),
        ("hold", "i8", 4),
        ("extended", "f8"),
        ("ahead", "f8"),
        ("late_stance", "f8"),
        ("passing", "f8"),
    ],
    align=True,
)
"""As in `biped.control.planar.record`."""

_ACTUATION = np.dtype(
    [
        ("generalized", "u1"), ("limit", "f8", NU),
        ("friction", "f8"), ("approach", "f8"), ("reach", "f8"), ("yielding", "f8"), ("regularisation", "f8"),
        ("stops", "u1"), ("follow", "f8"),
    ],
    align=True,
)  # fmt: skip
"""How Q_d becomes torques [N m]: as in `biped.control.planar.record`."""

_MEMORY = np.dtype(
    [
        ("believed", "u1", ENDS), ("waiting", "i8", ENDS), ("phase", "i8", LEGS),
        ("held", "u1", UNKNOWNS), ("pressed", "u1", UNKNOWNS), ("side", "i8", NU),
        ("latest", "f8", NU),
    ],
    align=True,
)  # fmt: skip
"""Memory from tick to tick: contacts, ticks that a change has lasted, leg states; sets of the latest allocation,
and its torques."""

_AT = np.dtype(
    [
        ("height", "f8", N_POINTS), ("speed", "f8", N_POINTS),  # m, m/s upward
        ("A", "f8", (2 * BASE, LEGS * LANES)),  # by column: motions of base and leg that move a point in a direction
        ("bias", "f8", (N_POINTS, DIRECTIONS)),  # J̇v [m/s²], up, forward, left
        ("angle", "f8", (LEGS, 3)), ("rate", "f8", (LEGS, 3)),  # thighs: sagittal, outward, outward about their axis
        ("torso", "f8", 3), ("torso_rate", "f8", 3),  # pitch, roll, yaw
        ("com", "f8", 3), ("com_velocity", "f8", 3), ("foot", "f8", (LEGS, 3)),
        ("M_leg", "f8", (LEGS, LEG, LEG)), ("M_cross", "f8", (LEGS, LEG, BASE)), ("M_base", "f8", (BASE, BASE)),
    ],
    align=True,
)  # fmt: skip
"""Where the walker is."""

_TICK = np.dtype(
    [
        ("Q_d", "f8", N), ("u", "f8", NU), ("limited", "u1"), ("placed", "f8", LEGS),
        ("force", "f8", UNKNOWNS), ("changes", "i8", 3),
    ],
    align=True,
)  # fmt: skip
"""Results of this tick."""

_WORK = np.dtype(
    [
        ("soft", "f8", NU), ("R_leg", "f8", (LEGS, LEG, LEG)), ("W", "f8", (LEGS, LEG, BASE)),
        ("R_base", "f8", (BASE, BASE)), ("C", "f8", (2 * BASE, LEGS * LANES)),
        ("D", "f8", (LEGS * LANES + LEGS + 1, LEGS * LANES)), ("stop", "f8", (LEGS, 2 * BASE)),
        # Of the forces that count, in order:
        ("kept", "i8", UNKNOWNS), ("up", "i8", UNKNOWNS), ("across", "i8", UNKNOWNS), ("slope", "f8", UNKNOWNS),
        ("least", "f8", UNKNOWNS), ("away", "f8", UNKNOWNS), ("price", "f8", UNKNOWNS),
        ("free", "u1", UNKNOWNS), ("order", "i8", UNKNOWNS),
        ("near", "u1", N_POINTS), ("standing", "u1", LEGS),  # points and legs that count
        ("row", "f8", (1, LEGS * LANES)), ("wanted", "f8", N), ("forces", "f8", N),
        ("H", "f8", (WIDTH, WIDTH)), ("U", "f8", (WIDTH, WIDTH)), ("L", "f8", (WIDTH, WIDTH)),
        ("f", "f8", (1, WIDTH)), ("x", "f8", (1, WIDTH)), ("y", "f8", (1, WIDTH)),
    ],
    align=True,
)  # fmt: skip
"""Work space of the allocation."""

CONTROL = np.dtype(
    [
        ("gait", GAIT), ("belief", _BELIEF), ("sensing", _SENSING), ("actuation", _ACTUATION),
        ("memory", _MEMORY), ("at", _AT), ("tick", _TICK), ("work", _WORK),
    ],
    align=True,
)  # fmt: skip
"""The controller."""


def new() -> np.ndarray:
    """A zeroed controller record, (1,)."""
    return np.zeros(1, CONTROL)
