"""Speed, steps, their width, and which way a robot goes."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.general.trajectory import GeneralTrajectory
from biped.measure.metrics.gait import MOVED, mean_of, stepping
from biped.robot.gravity import GRAVITY
from biped.robot.robot import Robot


def travelled(t: GeneralTrajectory, span: slice) -> float:
    """Distance [m] over a span that costs and slip are divided by; nan for one that got nowhere."""
    way = t.base[span, :2]
    far = float(np.linalg.norm(way[-1] - way[0]))
    return far if far >= MOVED else math.nan


def foot_places(t: GeneralTrajectory) -> np.ndarray:
    """(n, feet, 3) [m] middle of each foot's contact points."""
    feet = t.robot.of_foot
    return np.stack([t.point[:, feet == i].mean(axis=1) for i in range(len(t.robot.feet))], axis=1)


def along_feet(robot: Robot) -> np.ndarray:
    """(P,) where the contact points stand along their feet, 0 heel … 1 toe; of a foot of one point 0."""
    out = []
    for foot in robot.feet:
        x = np.array(foot.points)[:, 0]
        out.append((x - x.min()) / (np.ptp(x) or 1.0))
    return np.concatenate(out)


def heel_places(t: GeneralTrajectory) -> np.ndarray:
    """(n, feet) [m] middle of the rear half of each foot's contact points, along the ground."""
    feet, rear = t.robot.of_foot, along_feet(t.robot) <= 0.5
    return np.stack(
        [t.point[:, (feet == i) & rear, 0].mean(axis=1) for i in range(len(t.robot.feet))], axis=1
    )  # fmt: skip


def headings(t: GeneralTrajectory) -> np.ndarray:
    """(n,) [rad] heading of the base, to the left positive, without jumps."""
    way = t.turn @ np.array(t.robot.forward)
    return np.unwrap(np.arctan2(way[:, 1], way[:, 0]))


def courses(t: GeneralTrajectory) -> np.ndarray:
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


def leans(t: GeneralTrajectory) -> np.ndarray:
    """(n,) [rad] lean of the base from the vertical, forward positive."""
    up = -np.array(t.gravity) / np.linalg.norm(t.gravity)
    forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
    axis = t.turn @ np.array(t.robot.upright)
    return np.arctan2(axis @ forward / np.linalg.norm(forward), axis @ up)


def stride(t: GeneralTrajectory, span: slice) -> dict[str, float]:
    """Speed, Froude number, steps, support phases and lean over a span of rows."""
    x, time = t.base[span, 0], t.time[span]
    seconds = float(time[-1] - time[0]) or math.nan
    speed = float(x[-1] - x[0]) / seconds
    moving = (x - np.roll(x, 1))[1:] / t.tick
    lean = leans(t)[span]
    way = t.base[span, :2] - t.base[span, :2].mean(axis=0)
    return {
        **stepping(t, span, heel_places(t)),
        "speed": speed,
        "speed_std": float(moving.std()),
        "froude": speed / math.sqrt(GRAVITY * t.robot.leg),
        "strayed": float(np.linalg.norm(way, axis=1).max()),
        "torso_lean": math.degrees(float(lean.mean())),
        "torso_sway": math.degrees(float(lean.std())),
        **(sideways(t, span) if not t.robot.planar else {}),
    }


def sideways(t: GeneralTrajectory, span: slice) -> dict[str, float]:
    """Of a robot that moves in space: step width, cross-over, heading and drift.

    Widths are across the course at the strike; a foot that lands beyond the other's place has crossed over.
    """
    place, heading = foot_places(t)[span], courses(t)[span]
    # Which foot is the left one: the one that is left of the other over the window as a whole.
    aside = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    across = ((place[:, 1, :2] - place[:, 0, :2]) * aside).sum(axis=1)
    sign = 1.0 if float(np.median(across)) >= 0.0 else -1.0
    widths = [sign * float(across[row - span.start]) for row, _ in t.strikes_in(span)]
    first = headings(t)[0]
    way = t.base[-1, :2] - t.base[0, :2]
    return {
        "step_width": mean_of(widths),
        "cross_over": float(np.mean([width < 0.0 for width in widths])) if widths else math.nan,
        "heading": math.degrees(float(headings(t)[-1] - first)),
        "drift": float(way @ np.array([-math.sin(first), math.cos(first)])),
    }
