"""Where each quantity of a planar biped stands in a row of its log."""

from __future__ import annotations

from biped.robot.planar.topology import LEGS, N_CONSTRAINTS, N_POINTS, N_STOPS, NQ, NU

# First column of each quantity in the log (compiled code needs plain numbers).
TIME = 0
Q = TIME + 1
V = Q + NQ
U = V + NQ
Q_D = U + NU
PHASE = Q_D + NQ
BELIEVED = PHASE + LEGS
ACTIVE = BELIEVED + N_POINTS
HEIGHT = ACTIVE + N_CONSTRAINTS
FORCE = HEIGHT + N_POINTS
STOP = FORCE + 2 * N_POINTS
WIDTH = STOP + N_STOPS

COLUMNS = {
    "time": (TIME, ()), "q": (Q, (NQ,)), "v": (V, (NQ,)), "u": (U, (NU,)), "Q_d": (Q_D, (NQ,)),
    "phase": (PHASE, (LEGS,)), "believed": (BELIEVED, (N_POINTS,)), "active": (ACTIVE, (N_CONSTRAINTS,)),
    "height": (HEIGHT, (N_POINTS,)), "force": (FORCE, (N_POINTS, 2)), "stop": (STOP, (N_STOPS,)),
}  # fmt: skip
"""First column of each quantity, and its shape."""
UNITS = {
    "time": "s", "q": "m, m, rad, then rad", "v": "m/s, m/s, rad/s, then rad/s", "u": "N m",
    "Q_d": "N, N, N m, then N m", "phase": "leg state 1 … 4", "believed": "0 or 1", "active": "0 or 1",
    "height": "m", "force": "N", "stop": "N m",
}  # fmt: skip
"""Units of the quantities of `COLUMNS`."""
