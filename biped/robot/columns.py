"""Where each quantity stands in a row of a trajectory's log: the robot says which there are."""

import math

from biped.robot.planar.topology import LEGS, N_CONSTRAINTS, N_POINTS, N_STOPS, NQ, NU
from biped.robot.robot import Robot

Columns = dict[str, tuple[int, tuple[int, ...]]]
"""First column of each quantity in a log, and its shape."""

# First column of each quantity in the log of seven links in a plane (compiled code needs plain numbers).
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

COLUMNS: Columns = {
    "time": (TIME, ()), "q": (Q, (NQ,)), "v": (V, (NQ,)), "u": (U, (NU,)), "Q_d": (Q_D, (NQ,)),
    "phase": (PHASE, (LEGS,)), "believed": (BELIEVED, (N_POINTS,)), "active": (ACTIVE, (N_CONSTRAINTS,)),
    "height": (HEIGHT, (N_POINTS,)), "force": (FORCE, (N_POINTS, 2)), "stop": (STOP, (N_STOPS,)),
}  # fmt: skip
"""First column of each quantity of seven links, and its shape."""
UNITS = {
    "time": "s", "q": "m, rad", "v": "m/s, rad/s", "u": "N m", "Q_d": "N, N m",
    "phase": "leg state 1 … 4", "believed": "0 or 1", "active": "0 or 1", "height": "m", "stop": "N m",
    "point": "m", "force": "N", "contact": "0 or 1", "com": "m", "com_velocity": "m/s",
    "base": "m, then quaternion (w first)", "figure": "m", "ground_force": "N",
    "energy": "J", "work": "J", "given": "J",
}  # fmt: skip
"""Units of all quantities."""


def columns_of(robot: Robot) -> Columns:
    """First column of each quantity in the log of a robot, and its shape."""
    if robot.seven_links is not None:
        return COLUMNS
    nq, nv, nu, points = len(robot.q_names), len(robot.v_names), len(robot.drives), len(robot.of_foot)
    shapes: dict[str, tuple[int, ...]] = {
        "time": (), "q": (nq,), "v": (nv,), "u": (nu,), "point": (points, 3), "force": (points, 3),
        "contact": (points,), "com": (3,), "com_velocity": (3,), "base": (7,), "figure": (7, 3), "ground_force": (3,),
        "energy": (), "work": (), "given": (),
    }  # fmt: skip
    out, first = {}, 0
    for name, shape in shapes.items():
        out[name] = first, shape
        first += math.prod(shape)
    return out


def width_of(robot: Robot) -> int:
    """Columns of the log of a robot, a law's own signals aside."""
    first, shape = list(columns_of(robot).values())[-1]
    return first + math.prod(shape)
