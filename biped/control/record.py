"""Everything the compiled control tick reads and remembers, as one numpy record.

One record instead of thirty arguments: a compiled function pays for every array it is handed, and a run's controller
is one thing that can be copied, saved and compared.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from biped.scenario.gains import Gains

# Row i of A: normal and tangential row of each point (right toe, right heel, left toe, left heel), then the knee stops.
ROWS = 10
STATES = 4
# Columns of the block R⁻ᵀ[E, Q_d]: seven, and one of zeros that fills up a vector register.
BLOCK = 8

CONTROL = np.dtype(
    [
        # -- the gait (rad, N m/rad, N m s/rad); state index 0 … 3 is leg state 1 … 4
        ("k_d1", "f8"), ("b_d1", "f8"), ("theta_b", "f8"),
        ("k", "f8", (STATES, 3)), ("b", "f8", (STATES, 3)),  # hip, knee, ankle
        ("theta_l", "f8", STATES), ("theta_a", "f8", STATES),
        # -- the model the controller believes in
        ("point", "f8", (4, 2)),  # m, toe and heel in the foot's frame
        ("centre", "f8", (7, 2)), ("mass", "f8", 7), ("gravity", "f8", 2),  # m, kg, m/s², for the bias forces
        ("tilt", "f8"),  # rad, added to the slope frame's angles to get the angles that Q_d uses
        ("perturbed", "u1"), ("mass_factor", "f8", (9, 9)), ("row_factor", "f8", (ROWS, 9)),
        # -- sensing
        ("contact_height", "f8"), ("knee_angle", "f8"),  # m, rad: when a point or knee is a candidate for A
        ("hold", "i8", 4),  # ticks before a change is believed: heel on, heel off, toe on, toe off
        ("extended", "f8"), ("ahead", "f8"), ("late_stance", "f8"),  # rad, of the leg states
        # -- the step back (m; rad, N m/rad, N m s/rad of the hip)
        ("backstep", "u1"), ("margin", "f8"), ("theta_back", "f8"), ("k_back", "f8"), ("b_back", "f8"),
        # -- allocation
        ("generalized", "u1"), ("release", "u1"), ("release_force", "f8"), ("single_tangential", "u1"),
        ("tolerance", "f8"), ("limit", "f8", 6), ("bounded", "u1"), ("u_0", "f8", 6), ("use_u_0", "u1"),
        # -- when the run is over
        ("fall_height", "f8"), ("fall_tilt", "f8"),  # m, rad
        # -- memory
        ("believed", "u1", 4), ("waiting", "i8", 4), ("phase", "i8", 2),
        ("back", "u1"),  # falling back: legs in the air step back
        # -- this tick
        ("height", "f8", 4), ("position", "f8", (4, 2)), ("joint", "f8", (7, 2)), ("angle", "f8", 7),
        ("rate", "f8", 7),
        ("joint_bias", "f8", (7, 2)), ("com", "f8", (7, 2)), ("com_bias", "f8", (7, 2)), ("h", "f8", 9),
        ("Q_d", "f8", 9), ("active", "u1", 6),  # four points, two knees
        ("u", "f8", 6), ("over", "u1"),  # over: a torque limit was exceeded and the bounded solution is wanted
        # -- work space of the allocation
        ("M", "f8", (9, 9)), ("R", "f8", (9, 9)), ("a", "f8", 9), ("A", "f8", (ROWS, 9)),
        ("b_v", "f8", ROWS), ("row", "i8", ROWS),
        ("C", "f8", (ROWS, 9)), ("tau", "f8", ROWS), ("pivot", "i8", ROWS), ("L", "f8", (ROWS, ROWS)),
        ("tau2", "f8", ROWS), ("d", "f8", ROWS), ("z", "f8", ROWS), ("force", "f8", ROWS),
        # The reduced problem has factors of its own: the bounded form asks for C's once more.
        ("tau_B", "f8", ROWS), ("pivot_B", "i8", ROWS),
        ("X", "f8", (9, BLOCK)), ("work", "f8", BLOCK), ("B", "f8", (9, 6)),
        ("rows", "i8"), ("rank", "i8"), ("reached", "i8"),
    ],
    align=True,
)  # fmt: skip


def new() -> np.ndarray:
    """A zeroed controller record, (1,)."""
    return np.zeros(1, CONTROL)


def set_gains(c, gains: Gains) -> None:
    """Writes a gait, complete, into a controller record."""
    g: Any = gains
    c["k_d1"], c["b_d1"], c["theta_b"] = g.k_d1, g.b_d1, np.radians(g.theta_b)
    c["k"] = np.transpose([g.k_d2, g.k_d3, g.k_d4])
    c["b"] = np.transpose([g.b_d2, g.b_d3, g.b_d4])
    c["theta_l"], c["theta_a"] = np.radians(g.theta_l), np.radians(g.theta_a)
