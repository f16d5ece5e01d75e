"""Contact forces, centre of pressure, slip, penetration and foot clearance."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.metrics.gait import travelled
from biped.measure.trajectory import Trajectory
from biped.robot.leg_states import FIRST_IN_AIR
from biped.robot.model import gravity
from biped.robot.topology import ENDS, HEEL, LEGS, TOE
from biped.robot.tree import Motion

_LOADED = 1.0
"""[N] of normal force from which a point counts as loaded."""


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
        return np.where(total > _LOADED, normal[..., 0] / total, math.nan)


def contact(t: Trajectory, whole: Motion, span: slice) -> dict[str, float]:
    """Support, centre of pressure, slip and clearance over a span of rows."""
    force = t.force[span]
    normal = force[..., 1]
    distance = travelled(t, span)
    sliding = np.abs(whole.point_velocity[span, :, 0]) * (normal > _LOADED)
    pressure = centre_of_pressure(force)
    weight = float(t.tree.mass.sum()) * -gravity(t.slope)[1]
    return {
        "support": float(normal.sum(axis=1).mean() / weight),
        "centre_of_pressure": float(np.nanmean(pressure)) if np.isfinite(pressure).any() else math.nan,
        "slip": float(sliding.sum() * t.tick / distance),
        "clearance": _clearance(t, whole, span),
    }


def _clearance(t: Trajectory, whole: Motion, span: slice) -> float:
    """Lowest point of a foot in the middle half of its swings [m]: the smallest over the span's swings."""
    lowest, least = math.nan, round(_SWING / t.tick)
    for leg in range(LEGS):
        air = np.concatenate([[0], (t.phase[span, leg] > FIRST_IN_AIR).astype(int), [0]])
        starts, ends = np.flatnonzero(np.diff(air) > 0), np.flatnonzero(np.diff(air) < 0)
        for start, end in zip(starts, ends, strict=True):
            if end - start < least:
                continue
            quarter = (end - start) // 4
            height = whole.point[span, TOE[leg] : HEEL[leg] + 1, 1][start + quarter : end - quarter].min()
            lowest = float(np.fmin(lowest, height))
    return lowest
