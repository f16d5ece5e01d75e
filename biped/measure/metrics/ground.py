"""Contact forces, centre of pressure, slip, penetration and foot clearance."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.contact import LOADED, swings_of
from biped.measure.logged import Logged
from biped.measure.metrics.gait import travelled
from biped.measure.metrics.sums import Sums
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY, gravity
from biped.robot.planar.topology import POINT_LEG

_SWING = 0.1
"""[s] in the air from which a swing has a clearance."""
ALONG = (1.0, 0.0, 1.0, 0.0)
"""Where the contact points of a planar biped stand along their feet, 0 heel … 1 toe."""


def centre_of_pressure(normal: np.ndarray, of_foot: np.ndarray, along: np.ndarray, least: float) -> np.ndarray:
    """Where the normal force acts under each foot (n, feet), 0 at the heel and 1 at the toe; nan where unloaded.

    Args:
        normal: (n, P) [N] normal forces of the ground on the contact points.
        of_foot: (P,) number of the foot of each.
        along: (P,) place of each along its foot.
        least: [N] under a foot from which it is loaded.
    """
    out = np.full((len(normal), of_foot.max() + 1), math.nan)
    for foot in range(out.shape[1]):
        mine = normal[:, of_foot == foot]
        total = mine.sum(axis=1)
        on = total > least
        out[on, foot] = mine[on] @ along[of_foot == foot] / total[on]
    return out


def slid(place: np.ndarray, normal: np.ndarray, of_foot: np.ndarray, least: float) -> float:
    """How far [m] loaded feet slide: from row to row, of each foot the mean over its points, weighted by their forces.

    Args:
        place: (n, P, k) [m] places of the contact points along the ground, in one direction or two.
        normal: (n, P) [N] normal forces of the ground on them.
        of_foot: (P,) number of the foot of each.
        least: [N] under a foot from which it is loaded.
    """
    step, normal = np.diff(place, axis=0), normal[:-1]
    moved = np.abs(step[..., 0]) if step.shape[2] == 1 else np.sqrt((step**2).sum(axis=2))
    way = 0.0
    for foot in range(of_foot.max() + 1):
        mine = normal[:, of_foot == foot]
        total = mine.sum(axis=1)
        on = total > least
        way += float(((mine * moved[:, of_foot == foot]).sum(axis=1)[on] / total[on]).sum())
    return way


def clearance(t: Logged, span: slice, above: np.ndarray, of_foot: np.ndarray) -> float:
    """Lowest point of a foot above the ground in the middle half of its swings [m]: the smallest of the span's.

    Args:
        t: The run.
        span: Rows; swings that it cuts are left out.
        above: (n, P) [m] heights of the contact points above the ground.
        of_foot: (P,) number of the foot of each.
    """
    lowest, least = math.nan, round(_SWING / t.tick)
    for foot in range(of_foot.max() + 1):
        mine = above[span][:, of_foot == foot]
        for swing in swings_of(t.down[span], foot):
            length = swing.stop - swing.start
            if length >= least:
                lowest = float(np.fmin(lowest, mine[swing.start + length // 4 : swing.stop - length // 4].min()))
    return lowest


def contact(t: Trajectory, sums: Sums) -> dict[str, float]:
    """Support, centre of pressure, slip and clearance over the window."""
    w, span, of_foot = sums.window, sums.span, np.array(POINT_LEG)
    assert span is not None
    weight = t.mass * -gravity(t.slope)[1]
    normal, point = t.force[span, :, 1], sums.point
    pressure = centre_of_pressure(normal, of_foot, np.array(ALONG), LOADED * t.mass * GRAVITY)
    sliding = slid(point[span, :, :1], normal, of_foot, LOADED * t.mass * GRAVITY)
    above = point[..., 1] - t.ground.height(point[..., 0])
    return {
        "support": float(w["normal"] / int(w["rows"]) / weight),
        **({} if t.seat_force is None else {"seat_load": float(w["sat"] / int(w["rows"]) / weight)}),
        "centre_of_pressure": float(np.nanmean(pressure)) if np.isfinite(pressure).any() else math.nan,
        "slip": sliding / travelled(sums),
        "clearance": clearance(t, span, above, of_foot),
    }
