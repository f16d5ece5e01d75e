"""Support, slip, clearance, and the margin of stability."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from biped.measure.contact import LOADED, feet_down
from biped.measure.general.gait import along_feet, courses, foot_places, travelled
from biped.measure.general.trajectory import GeneralTrajectory
from biped.measure.metrics.ground import centre_of_pressure, clearance, slid
from biped.robot.gravity import GRAVITY


def contact(t: GeneralTrajectory, span: slice) -> dict[str, float]:
    """Support, centre of pressure, slip and clearance over a span of rows."""
    weight, least, of_foot = -t.robot.mass * t.gravity[2], LOADED * t.mass * GRAVITY, t.robot.of_foot
    normal = t.force[span][:, :, 2]
    pressure = centre_of_pressure(normal, of_foot, along_feet(t.robot), least)
    return {
        "support": float(t.ground_force[span, 2].mean() / weight),
        "centre_of_pressure": float(np.nanmean(pressure)) if np.isfinite(pressure).any() else math.nan,
        "slip": slid(t.point[span, :, :2], normal, of_foot, least) / travelled(t, span),
        "clearance": clearance(t, span, t.above, of_foot),
        **({} if t.robot.planar else {"margin_of_stability": margin_of_stability(t, span)}),
    }


def bearing(t: GeneralTrajectory) -> np.ndarray:
    """(n, P) whether each contact point bears its share of what makes a foot loaded (`biped.measure.contact`)."""
    points = np.bincount(t.robot.of_foot)[t.robot.of_foot]
    return feet_down(t.force[:, :, 2] * points, t.mass * GRAVITY, t.tick)


def extrapolated(t: GeneralTrajectory) -> np.ndarray:
    """(n, 2) [m] extrapolated centre of mass (Hof): where a foot would have to be for it to come to rest above."""
    height = np.maximum(t.com[:, 2] - t.ground.height(t.com[:, 0]), 1e-3)
    return t.com[:, :2] + t.com_velocity[:, :2] * np.sqrt(height / GRAVITY)[:, None]


def outline(points: np.ndarray) -> np.ndarray:
    """(k, 2) corners of the convex hull of points (n, 2) [m], anticlockwise from the rearmost (Andrew's chain)."""
    places = sorted({(float(x), float(y)) for x, y in points})
    if len(places) < 3:
        return np.array(places).reshape(-1, 2)
    half: list[list[tuple[float, float]]] = []
    for way in (places, places[::-1]):
        chain: list[tuple[float, float]] = []
        for place in way:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], place) <= 0.0:
                chain.pop()
            chain.append(place)
        half.append(chain[:-1])
    return np.array(half[0] + half[1])


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Twice the area of a triangle; positive if a, b, c go round anticlockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def margin_of_stability(t: GeneralTrajectory, span: slice) -> float:
    """[m] lateral distance from the extrapolated centre of mass to the outer edge of what it stands on.

    The mean over steps of the least in each; of a robot that takes none, the least.
    """
    heading = courses(t)
    aside = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    reach = (t.point[:, :, :2] * aside[:, None]).sum(axis=2)
    at = (extrapolated(t) * aside).sum(axis=1)
    touching = bearing(t)
    left = np.where(touching, reach, -np.inf).max(axis=1) - at
    right = at - np.where(touching, reach, np.inf).min(axis=1)
    margin = np.where(touching.any(axis=1), np.minimum(left, right), np.nan)
    # By what bears, as the edges are: a foot that lost its force for a moment is down, but bounds nothing.
    standing = np.stack([touching[:, t.robot.of_foot == foot].any(axis=1) for foot in range(len(t.robot.feet))], axis=1)
    single = standing.sum(axis=1) == 1
    if single[span].any():
        # On one foot only its outer edge bounds it: beyond the inner one the other foot comes down.
        foot = np.argmax(standing, axis=1)
        middle = (foot_places(t)[:, :, :2] * aside[:, None]).sum(axis=2)
        outer_left = np.take_along_axis(middle, foot[:, None], 1)[:, 0] > middle.mean(axis=1)
        margin = np.where(single, np.where(outer_left, left, right), margin)
    cuts = [span.start, *(row for row, _ in t.strikes if span.start < row < span.stop), span.stop]
    least = [float(np.nanmin(margin[a:b])) for a, b in pairwise(cuts)
             if np.isfinite(margin[a:b]).any()]  # fmt: skip
    return float(np.mean(least)) if least else math.nan
