"""Everything the compiled control tick reads and remembers, as one numpy record of parts.

One record instead of thirty arguments: a compiled function pays for every array it is handed, and a run's controller
is one thing that can be copied, saved and compared. A part has one job: `c["gait"]["k"]` are springs, `c["work"]["L"]`
is nobody's but the solver's.
"""

import numpy as np

from biped.numerics.lanes import LANES
from biped.numerics.triangular import BLOCK
from biped.robot.ground import GROUND
from biped.robot.leg_states import STATES
from biped.robot.planar.kinematics import PLACES, TREE
from biped.robot.planar.topology import BASE, LEGS, N_CONSTRAINTS, N_POINTS, N_ROWS, NQ, NU, SEGMENTS

GAIT = np.dtype(
    [
        ("k_d1", "f8"), ("b_d1", "f8"), ("theta_b", "f8"),
        ("k", "f8", (STATES, SEGMENTS)), ("b", "f8", (STATES, SEGMENTS)),  # hip, knee, ankle
        ("theta_l", "f8", STATES), ("theta_a", "f8", STATES),
    ],
    align=True,
)  # fmt: skip
"""The gait [rad, N m/rad, N m s/rad] by leg state."""

_BELIEF = np.dtype(
    [
        ("gravity", "f8", 2),  # m/s²
        ("tilt", "f8"),  # rad, added to the slope frame's angles to get the angles that Q_d uses
        ("perturbed", "u1"), ("mass_factor", "f8", (NQ, NQ)), ("row_factor", "f8", (N_ROWS, NQ)),
        ("redrawn", "u1"), ("mass_error", "f8"), ("row_error", "f8"), ("generator", "i8", 2),
    ],
    align=True,
)  # fmt: skip
"""The controller's belief beyond the tree: gravity, and the errors of its M and A; if redrawn, anew at every tick."""

_SENSING = np.dtype(
    [
        ("contact_height", "f8"), ("knee_angle", "f8"),  # m, rad: when a point or knee is a candidate for A
        ("hold", "i8", 4),  # ticks before a change is believed: heel on, heel off, toe on, toe off
        ("extended", "f8"), ("ahead", "f8"), ("late_stance", "f8"), ("passing", "f8"),  # rad, of the leg states
    ],
    align=True,
)  # fmt: skip
"""When a point touches, and what the leg states follow from."""

_SWITCHES = np.dtype(
    [("on", "u1"), ("touching", "u1", N_POINTS), ("believed", "u1"), ("under", "f8", N_POINTS)], align=True
)
"""Foot switches, where they and not heights decide what touches (`biped.control.planar.estimator`); where the state is
predicted, the heights [m] that the ground under the points must then have had (`biped.control.planar.prediction`)."""

_BACKSTEP = np.dtype([("on", "u1"), ("margin", "f8"), ("theta_l", "f8"), ("k_d2", "f8"), ("b_d2", "f8")], align=True)
"""The step back [m; rad, N m/rad, N m s/rad of the hip]."""

_ACTUATION = np.dtype(
    [
        ("generalized", "u1"), ("release", "u1"), ("release_force", "f8"), ("single_tangential", "u1"),
        ("tolerance", "f8"), ("limit", "f8", NU), ("bounded", "u1"), ("u_0", "f8", NU), ("use_u_0", "u1"),
    ],
    align=True,
)  # fmt: skip
"""How Q_d becomes torques [N, N m]."""

_MEMORY = np.dtype(
    [
        ("believed", "u1", N_POINTS), ("waiting", "i8", N_POINTS), ("phase", "i8", LEGS), ("back", "u1"),
        ("side", "i8", NU),  # limits that torques were last at, where the bounded problem begins
    ],
    align=True,
)  # fmt: skip
"""Memory from tick to tick: contacts, ticks that a change has lasted, leg states, whether it is falling back."""

_TICK = np.dtype(
    [
        ("height", "f8", N_POINTS), ("h", "f8", NQ), ("given", "u1"), ("Q_d", "f8", NQ),
        ("active", "u1", N_CONSTRAINTS),
        # given: h is somebody else's, and not computed here
        ("rows", "i8"), ("rank", "i8"),  # of A after the release test, and of C
        ("u", "f8", NU), ("over", "u1"),  # over: a torque limit was exceeded and the bounded solution is wanted
    ],
    align=True,
)  # fmt: skip
"""Results of this tick."""

_WORK = np.dtype(
    [
        ("M", "f8", (NQ, NQ)), ("R", "f8", (NQ, NQ)), ("a", "f8", NQ), ("A", "f8", (N_ROWS, NQ)),
        ("b_v", "f8", N_ROWS), ("row", "i8", N_ROWS),
        ("C", "f8", (N_ROWS, NQ)), ("tau", "f8", N_ROWS), ("pivot", "i8", N_ROWS), ("L", "f8", (N_ROWS, N_ROWS)),
        ("tau2", "f8", N_ROWS), ("d", "f8", N_ROWS), ("z", "f8", N_ROWS), ("force", "f8", N_ROWS),
        # The reduced problem has factors of its own: the bounded form asks for C's once more.
        ("tau_B", "f8", N_ROWS), ("pivot_B", "i8", N_ROWS),
        ("X", "f8", (NQ, BLOCK)), ("line", "f8", BLOCK), ("B", "f8", (NQ, NU)),
        # The bounded problem min ½ uᵀP u - rᵀu.
        ("P", "f8", (NU, NU)), ("r", "f8", NU), ("lower", "f8", NU), ("root", "f8", (NU, NU)), ("x", "f8", NU),
    ],
    align=True,
)  # fmt: skip
"""Work space of the allocation."""

_ROWS = np.dtype(
    [
        ("A", "f8", (NQ, LANES)), ("C", "f8", (NQ, LANES)), ("E", "f8", (NQ, LANES)),  # columns of rows of A
        ("b_v", "f8", (1, LANES)), ("kept", "f8", (1, LANES)), ("force", "f8", (1, LANES)),
        ("free", "f8", (1, LANES)),  # 1: not yet a pivot
        ("V", "f8", (NQ, LANES)), ("T", "f8", (NQ, NQ)), ("z", "f8", NQ),
        ("spring", "f8", NU), ("L", "f8", (NQ, NQ)), ("S", "f8", (BASE, BASE)),
        ("D", "f8", (BASE, LANES)), ("Y", "f8", (NU, LANES)),
    ],
    align=True,
)  # fmt: skip
"""Work space of the allocation by floating coordinates, a row of A in each lane (`biped.numerics.lanes`)."""

_PUSH = np.dtype(
    [
        ("on", "u1"),
        ("friction", "f8"), ("approach", "f8"), ("reach", "f8"), ("yielding", "f8"), ("regularisation", "f8"),
        ("counted", "i8"),  # forces that torques count on: those of points, and perhaps of stops
        ("follow", "f8"), ("latest", "f8", NU),  # fraction of the way that torques go in a tick, and where they are
        # The sets of the latest tick, with which the next one begins: forces of the wanted motion and of the torques'
        # problem that may be positive, and torques at a limit (-1, 1).
        ("held", "u1", N_ROWS), ("pressed", "u1", N_ROWS), ("side", "i8", NU),
        ("changes", "i8", 2),  # how often the two sets changed in this tick
        ("speed", "f8", N_POINTS),  # m/s with which points rise
        ("scale", "f8", (1, LANES)),  # m: an angle of a stop as a distance; 1 for points
        ("least", "f8", (1, LANES)), ("away", "f8", (1, LANES)), ("rho", "f8", (1, LANES)),
        ("wanted_force", "f8", (1, LANES)), ("slack", "f8", (1, LANES)),
        ("force", "f8", (1, LANES)), ("price", "f8", (1, LANES)),
        ("H", "f8", (N_ROWS, LANES)), ("f", "f8", (1, LANES)), ("order", "i8", N_ROWS), ("U", "f8", (N_ROWS, LANES)),
    ],
    align=True,
)  # fmt: skip
"""Ground that only pushes (`biped.control.planar.pushing`): settings, what it remembers, and work space."""

CONTROL = np.dtype(
    [
        ("gait", GAIT), ("tree", TREE), ("belief", _BELIEF), ("sensing", _SENSING), ("switches", _SWITCHES),
        ("backstep", _BACKSTEP), ("actuation", _ACTUATION), ("memory", _MEMORY), ("at", PLACES),
        ("tick", _TICK),
        ("work", _WORK), ("rows", _ROWS), ("push", _PUSH),
        ("ground", GROUND),
    ],
    align=True,
)  # fmt: skip
"""The controller; `tree` and `at` are the lengths and masses it believes in and where it senses itself to be, `ground`
the ground above which it senses heights."""


def new() -> np.ndarray:
    """A zeroed controller record, (1,)."""
    return np.zeros(1, CONTROL)
