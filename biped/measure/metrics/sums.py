"""One pass over the rows of a run, in compiled code: the sums and extremes that its metrics are made of."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from biped.base.jit import entry_kernel
from biped.measure import verdict
from biped.measure.metrics.rows import add_row
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import gravity
from biped.robot.ground import GROUND, set_ground
from biped.robot.planar.kinematics import PLACES, TREE
from biped.robot.planar.topology import N_POINTS, NU

_TOLD = np.dtype(
    [
        ("generalized", "u1"), ("gravity", "f8", 2), ("limit", "f8", NU),  # m/s², N m
        ("first", "i8"), ("last", "i8"),  # of the window
        *((name, "f8") for name in verdict.Most._fields),
    ],
    align=True,
)  # fmt: skip
"""What the pass has to know of the run."""

_RUN = np.dtype(
    [
        ("squared", "f8"), ("moving", "f8"),  # largest of a link's squared speed, and of kinetic energy
        ("depth", "f8"), ("normal", "f8"), ("torque", "f8"),  # largest
        ("energy", "f8", 2), ("momentum", "f8", 2),  # J and N s upward, in the first and the last row
        # Powers of the steps, summed: all that act, and what actuators and pushes put in or take.
        ("work", "f8"), ("put_in", "f8"),
        # The same by how far things went, J: so far, either way, and the most energy beyond it.
        ("given", "f8"), ("given_either_way", "f8"), ("nowhere", "f8"),
        ("impulse", "f8"),  # normal forces of all rows but the last, summed
    ],
    align=True,
)  # fmt: skip
"""Of the whole run."""

_WINDOW = np.dtype(
    [
        ("rows", "i8"), ("time", "f8", 2), ("x", "f8", 2), ("x_range", "f8", 2), ("x_sum", "f8"),
        # Forward velocity and pitch: in the first row, and sums of deviations from there.
        ("start", "f8", 2), ("away", "f8", 2), ("away_squared", "f8", 2),
        ("switches", "i8"), ("constraint_switches", "i8"),
        ("torque", "f8", NU), ("torque_most", "f8", NU), ("power_most", "f8", NU), ("jumps", "f8"), ("saturated", "i8"),
        ("net", "f8"), ("absolute", "f8"), ("positive", "f8"), ("peak", "f8"),  # powers
        ("ground_power", "f8"), ("normal", "f8"),
        ("sat", "f8"),  # normal forces of a seat
    ],
    align=True,
)  # fmt: skip
"""Of the rows in the window; sums where nothing else is said."""

SUMS = np.dtype(
    [
        ("told", _TOLD),
        ("tree", TREE),
        ("ground", GROUND),
        ("run", _RUN),
        ("window", _WINDOW),
        ("even", PLACES),
        ("odd", PLACES),
    ],
    align=True,
)
"""What the pass knows and finds; places are those of the latest two rows."""


class Sums(NamedTuple):
    """What the pass found.

    Attributes:
        run: Sums over all rows, `_RUN`.
        window: Sums over the window, `_WINDOW`.
        fast: The first row in which a link is too fast, where the pass ends; None if there is none.
        span: Rows of the window; None if it has less than two.
        point: (n, 4, 2) [m] places of the contact points, of the rows before (the first, if that is too fast).
    """

    run: np.void
    window: np.void
    fast: int | None
    span: slice | None
    point: np.ndarray


def add_up(t: Trajectory, window: tuple[float, float]) -> Sums:
    """Passes over a run.

    Args:
        t: The run.
        window: [s] start and end of the interval that means are taken over.
    """
    sums = np.zeros(1, SUMS)
    told = sums[0]["told"]
    first = int(np.searchsorted(t.time, window[0] - 1e-9))
    last = int(np.searchsorted(t.time, window[1] + 1e-9, side="right"))
    told["generalized"], told["gravity"], told["limit"] = t.generalized, gravity(t.slope), t.torque_limit
    told["first"], told["last"] = first, last
    for name, value in verdict.most(t)._asdict().items():
        told[name] = value
    for name, value in t.tree._asdict().items():
        sums["tree"][0][name] = value
    set_ground(sums["ground"][0], t.ground)
    point = np.empty((len(t), N_POINTS, 2))
    seat = np.empty((0, 3)) if t.seat_force is None else np.ascontiguousarray(t.seat_force)
    fast = _add_rows(sums, np.ascontiguousarray(t.log), point, _pushes(t), seat)
    rows = max(1, fast)
    last = min(last, rows)
    span = slice(first, last) if last - first > 1 else None
    return Sums(sums[0]["run"], sums[0]["window"], None if fast == len(t) else fast, span, point[:rows])


def _pushes(t: Trajectory) -> np.ndarray:
    """Pushes on links (m, 5): first row, last row + 1, force along and normal to the ground [N], number of the link."""
    c, s = math.cos(math.radians(t.slope)), math.sin(math.radians(t.slope))
    found = [
        (round(start / t.tick), round(end / t.tick), forward * c + up * s, up * c - forward * s,
         t.robot.bodies.index(body))
        for start, end, forward, up, body in t.pushes if body in t.robot.bodies
    ]  # fmt: skip
    return np.array(found, dtype=float).reshape(-1, 5)


@entry_kernel
def _add_rows(sums, log, point, pushes, seat):
    """Adds rows up to the first that is too fast, and returns its number; that of rows if there is none."""
    s = sums[0]
    s["run"]["depth"] = s["run"]["normal"] = -math.inf
    for k in range(log.shape[0]):
        at, before = (s["even"], s["odd"]) if k % 2 == 0 else (s["odd"], s["even"])
        if add_row(s, at, before, log, point, pushes, seat, k):
            return k
    return log.shape[0]
