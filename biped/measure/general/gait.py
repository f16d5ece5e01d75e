"""Speed, steps, their width, and which way a robot goes."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from biped.measure.general.trajectory import GeneralTrajectory
from biped.measure.metrics.gait import MOVED, strikes
from biped.robot.gravity import GRAVITY
from biped.robot.leg_states import FIRST_IN_AIR

Strike = tuple[int, int]
"""Row and foot."""


def strikes_of(t: GeneralTrajectory) -> list[Strike]:
    """Foot strikes (row, foot), as of leg states that say no more than whether a foot is on the ground."""
    return strikes(np.where(t.down, 1, FIRST_IN_AIR + 1), t.tick)


def travelled(t: GeneralTrajectory, span: slice) -> float:
    """Distance [m] over a span that costs and slip are divided by; nan for one that got nowhere."""
    way = t.base[span, :2]
    far = float(np.linalg.norm(way[-1] - way[0]))
    return far if far >= MOVED else math.nan


def foot_places(t: GeneralTrajectory) -> np.ndarray:
    """(n, feet, 3) [m] middle of each foot's contact points."""
    feet = t.robot.of_foot
    return np.stack([t.point[:, feet == i].mean(axis=1) for i in range(len(t.robot.feet))], axis=1)


def headings(t: GeneralTrajectory) -> np.ndarray:
    """(n,) [rad] heading of the base, to the left positive, without jumps."""
    way = t.turn @ np.array(t.robot.forward)
    return np.unwrap(np.arctan2(way[:, 1], way[:, 0]))


def courses(t: GeneralTrajectory) -> np.ndarray:
    """(n,) [rad] headings without the turning to and fro of each stride: means over the stride around each row.

    (Feet are a step apart: seen from a torso that has turned by 7°, they are 7 cm further apart than they are.)
    """
    way = headings(t)
    steps = [row for row, _ in strikes_of(t)]
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
    x, time, down = t.base[span, 0], t.time[span], t.down[span]
    seconds = float(time[-1] - time[0]) or math.nan
    speed = float(x[-1] - x[0]) / seconds
    found = [(row - span.start, foot) for row, foot in strikes_of(t) if span.start <= row < span.stop]
    feet = np.array([foot for _, foot in found])
    place = foot_places(t)[span]
    apart = [place[row, foot] - place[row, 1 - foot] for row, foot in found]
    moving = (x - np.roll(x, 1))[1:] / t.tick
    lean = leans(t)[span]
    way = t.base[span, :2] - t.base[span, :2].mean(axis=0)
    return {
        "speed": speed,
        "speed_std": float(moving.std()),
        "froude": speed / math.sqrt(GRAVITY * t.robot.leg),
        "step_length": _mean([abs(float(one[0])) for one in apart]),
        "step_frequency": len(found) / seconds,
        "steps": len(found),
        "alternation": float(np.mean(feet[1:] != feet[:-1])) if len(feet) > 1 else math.nan,
        "strayed": float(np.linalg.norm(way, axis=1).max()),
        "double_support": float(down.all(axis=1).mean()),
        "flight": float((~down.any(axis=1)).mean()),
        "duty": float(down.mean()),
        "step_duration": _mean([t.tick * (b - a) for (a, _), (b, _) in pairwise(found)]),
        "torso_lean": math.degrees(float(lean.mean())),
        "torso_sway": math.degrees(float(lean.std())),
        **(sideways(t, span, found) if not t.robot.planar else {}),
    }


def sideways(t: GeneralTrajectory, span: slice, found: list[Strike]) -> dict[str, float]:
    """Of a robot that moves in space: step width, cross-over, heading and drift.

    Widths are across the course at the strike; a foot that lands beyond the other's place has crossed over.
    """
    place, heading = foot_places(t)[span], courses(t)[span]
    # Which foot is the left one: the one that is left of the other over the window as a whole.
    aside = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    across = ((place[:, 1, :2] - place[:, 0, :2]) * aside).sum(axis=1)
    sign = 1.0 if float(np.median(across)) >= 0.0 else -1.0
    widths = [sign * float(across[row]) for row, _ in found]
    first = headings(t)[0]
    way = t.base[-1, :2] - t.base[0, :2]
    return {
        "step_width": _mean(widths),
        "cross_over": float(np.mean([width < 0.0 for width in widths])) if widths else math.nan,
        "heading": math.degrees(float(headings(t)[-1] - first)),
        "drift": float(way @ np.array([-math.sin(first), math.cos(first)])),
    }


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else math.nan
