"""Contact forces, centre of pressure, slip, penetration and foot clearance."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.metrics.gait import travelled
from biped.measure.metrics.rows import LOADED
from biped.measure.metrics.sums import Sums
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import gravity
from biped.robot.leg_states import FIRST_IN_AIR
from biped.robot.topology import ENDS, HEEL, LEGS, TOE

_SWING = 0.1
"""[s] in the air from which a swing has a clearance."""


def centre_of_pressure(force: np.ndarray) -> np.ndarray:
    """Where the normal force acts under each foot (n, 2), 0 at the heel and 1 at the toe; nan where unloaded.

    Args:
        force: (n, 4, 2) [N] ground forces.
    """
    normal = force[..., 1].reshape(-1, LEGS, ENDS)
    total = normal.sum(axis=2)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(total > LOADED, normal[..., 0] / total, math.nan)


def contact(t: Trajectory, sums: Sums) -> dict[str, float]:
    """Support, centre of pressure, slip and clearance over the window."""
    w = sums.window
    weight = float(t.tree.mass.sum()) * -gravity(t.slope)[1]
    return {
        "support": float(w["normal"] / int(w["rows"]) / weight),
        **({} if t.seat_force is None else {"seat_load": float(w["sat"] / int(w["rows"]) / weight)}),
        "centre_of_pressure": float(w["pressure"] / w["pressed"]) if w["pressed"] else math.nan,
        "slip": float(w["sliding"] * t.tick / travelled(sums)),
        "clearance": _clearance(t, sums),
    }


def _clearance(t: Trajectory, sums: Sums) -> float:
    """Lowest point of a foot above the ground in the middle half of its swings [m]: the smallest of the window's."""
    lowest, least = math.nan, round(_SWING / t.tick)
    for leg in range(LEGS):
        air = np.concatenate([[0], (t.phase[sums.span, leg] > FIRST_IN_AIR).astype(int), [0]])
        starts, ends = np.flatnonzero(np.diff(air) > 0), np.flatnonzero(np.diff(air) < 0)
        for start, end in zip(starts, ends, strict=True):
            if end - start < least:
                continue
            quarter = (end - start) // 4
            point = sums.point[sums.span, TOE[leg] : HEEL[leg] + 1][start + quarter : end - quarter]
            height = (point[..., 1] - t.ground.height(point[..., 0])).min()
            lowest = float(np.fmin(lowest, height))
    return lowest
