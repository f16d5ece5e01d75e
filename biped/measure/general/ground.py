"""Support, slip, clearance, and the margin of stability."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from biped.measure.general.gait import courses, foot_places, strikes_of, travelled
from biped.measure.general.trajectory import GeneralTrajectory
from biped.measure.metrics.rows import LOADED
from biped.robot.gravity import GRAVITY

_SWING = 0.1
"""[s] in the air from which a swing has a clearance."""


def contact(t: GeneralTrajectory, span: slice) -> dict[str, float]:
    """Support, slip and clearance over a span of rows."""
    weight = -t.robot.mass * t.gravity[2]
    moved = np.linalg.norm(np.diff(t.point[span, :, :2], axis=0), axis=2)
    sliding = moved[t.force[span][:-1, :, 2] > LOADED].sum()
    return {
        "support": float(t.ground_force[span, 2].mean() / weight),
        "slip": float(sliding / travelled(t, span)),
        "clearance": _clearance(t, span),
        **({} if t.robot.planar else {"margin_of_stability": margin_of_stability(t, span)}),
    }


def _clearance(t: GeneralTrajectory, span: slice) -> float:
    """Lowest point of a foot in the middle half of its swings [m]: the smallest over the window's swings."""
    lowest, least, feet = math.nan, round(_SWING / t.tick), t.robot.of_foot
    for foot in range(len(t.robot.feet)):
        edges = np.diff(np.concatenate([[0], (~t.down[span, foot]).astype(int), [0]]))
        for start, end in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
            if end - start >= least:
                quarter = (end - start) // 4
                height = t.above[span][start + quarter : end - quarter, feet == foot].min()
                lowest = float(np.fmin(lowest, height))
    return lowest


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
    touching = t.contact > 0.0
    left = np.where(touching, reach, -np.inf).max(axis=1) - at
    right = at - np.where(touching, reach, np.inf).min(axis=1)
    margin = np.where(touching.any(axis=1), np.minimum(left, right), np.nan)
    # By what touches, as the edges are: a foot a hair above the ground is down, but bounds nothing.
    standing = np.stack([touching[:, t.robot.of_foot == foot].any(axis=1) for foot in range(len(t.robot.feet))], axis=1)
    single = standing.sum(axis=1) == 1
    if single[span].any():
        # On one foot only its outer edge bounds it: beyond the inner one the other foot comes down.
        foot = np.argmax(standing, axis=1)
        middle = (foot_places(t)[:, :, :2] * aside[:, None]).sum(axis=2)
        outer_left = np.take_along_axis(middle, foot[:, None], 1)[:, 0] > middle.mean(axis=1)
        margin = np.where(single, np.where(outer_left, left, right), margin)
    cuts = [span.start, *(row for row, _ in strikes_of(t) if span.start < row < span.stop), span.stop]
    least = [float(np.nanmin(margin[a:b])) for a, b in pairwise(cuts)
             if np.isfinite(margin[a:b]).any()]  # fmt: skip
    return float(np.mean(least)) if least else math.nan
