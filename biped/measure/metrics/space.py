"""Metrics of robots that move in space alone: step width, heading, drift, and the margin of stability sideways."""

import math
from itertools import pairwise

import numpy as np

from biped.measure.contact import feet_down
from biped.measure.metrics.gait import mean_of
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY


def foot_places(t: Trajectory) -> np.ndarray:
    """(n, feet, 3) [m] middle of each foot's contact points."""
    feet = t.robot.of_foot
    return np.stack([t.point[:, feet == i].mean(axis=1) for i in range(len(t.robot.feet))], axis=1)


def headings(t: Trajectory) -> np.ndarray:
    """(n,) [rad] heading of the base, to the left positive, without jumps."""
    return t.robot.heading(t.turn)


def courses(t: Trajectory) -> np.ndarray:
    """(n,) [rad] headings without the turning to and fro of each stride: means over the stride around each row.

    (Feet are a step apart: seen from a torso that has turned by 7°, they are 7 cm further apart than they are.)
    """
    way = headings(t)
    steps = [row for row, _ in t.strikes]
    stride = 2 * round(float(np.median(np.diff(steps)))) if len(steps) > 2 else 1
    stride = min(max(stride, 1), len(way))
    total = np.concatenate([[0.0], np.cumsum(way)])
    first = np.clip(np.arange(len(way)) - stride // 2, 0, len(way) - stride)
    return (total[first + stride] - total[first]) / stride


def sideways(t: Trajectory, span: slice) -> dict[str, float]:
    """Step width, cross-over, heading, drift and margin of stability over a span of rows.

    Widths are across the course at the strike; a foot that lands beyond the other's place has crossed over.
    """
    place, heading = foot_places(t)[span], courses(t)[span]
    # Which foot is the left one: the one that is left of the other over the window as a whole.
    aside = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    across = ((place[:, 1, :2] - place[:, 0, :2]) * aside).sum(axis=1)
    sign = 1.0 if float(np.median(across)) >= 0.0 else -1.0
    widths = [sign * float(across[row - span.start]) for row, _ in t.strikes_in(span)]
    faced, way = headings(t), t.base[-1, :2] - t.base[0, :2]
    first = faced[0]
    return {
        "step_width": mean_of(widths),
        "cross_over": mean_of([width < 0.0 for width in widths]),
        "heading": math.degrees(float(faced[-1] - first)),
        "drift": float(way @ np.array([-math.sin(first), math.cos(first)])),
        "margin_of_stability": margin_of_stability(t, span),
    }


def bearing(t: Trajectory) -> np.ndarray:
    """(n, P) whether each contact point bears its share of what makes a foot loaded (`biped.measure.contact`)."""
    points = np.bincount(t.robot.of_foot)[t.robot.of_foot]
    return feet_down(t.force[:, :, 2] * points, t.mass * GRAVITY, t.tick)


def extrapolated(t: Trajectory) -> np.ndarray:
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


def margin_of_stability(t: Trajectory, span: slice) -> float:
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
