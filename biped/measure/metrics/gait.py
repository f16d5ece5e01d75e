"""Speed, steps and leg states."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from biped.measure.logged import Logged
from biped.measure.metrics.sums import Sums
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY
from biped.robot.leg_states import STANCE
from biped.robot.planar.topology import HEEL

MOVED = 0.1
"""[m] that must be travelled in the window for numbers per distance."""


def stepping(t: Logged, span: slice, heel: np.ndarray) -> dict[str, float]:
    """Steps and support phases over a span of rows, by the ground's force alone.

    Args:
        t: The run.
        span: Rows.
        heel: (n, 2) [m] places of the heels along the ground.
    """
    down, found = t.down[span], t.strikes_in(span)
    seconds = float(t.time[span][-1] - t.time[span][0]) or math.nan  # a run that ended in its first tick has no rates
    rows, feet = np.array(found, dtype=int).reshape(-1, 2).T
    return {
        "step_length": mean_of(np.abs(heel[rows, 0] - heel[rows, 1])),
        "step_frequency": len(found) / seconds,
        "step_duration": mean_of(t.tick * np.diff(rows)),
        "steps": len(found),
        "alternation": mean_of(feet[1:] != feet[:-1]),
        "double_support": float(down.all(axis=1).mean()),
        "flight": float((~down.any(axis=1)).mean()),
        "duty": float(down.mean()),
    }


def mean_of(values: Sequence[float] | np.ndarray) -> float:
    """The mean of some numbers; nan of none."""
    return float(np.mean(values)) if len(values) else math.nan


def travelled(sums: Sums) -> float:
    """Distance [m] over the window that costs and slip are divided by; nan for one that got nowhere.

    A robot that stands has no cost of transport: what it spends over the centimetres that it sways is no number.
    """
    start, end = sums.window["x"].tolist()
    return abs(end - start) if abs(end - start) >= MOVED else math.nan


def stride(t: Trajectory, sums: Sums) -> dict[str, float]:
    """Speed, Froude number, steps, support phases, lean and switching over the window."""
    w, span = sums.window, sums.span
    assert span is not None
    rows, (start, end), (began, ended) = int(w["rows"]), w["x"].tolist(), w["time"].tolist()
    seconds = ended - began or math.nan  # a run that ended in its first tick has no rates
    speed = (end - start) / seconds
    away = w["away"] / rows
    spread = np.sqrt(np.maximum(w["away_squared"] / rows - away**2, 0.0))
    middle = float(w["x_sum"]) / rows
    return {
        **stepping(t, span, sums.point[:, HEEL, 0]),
        "speed": speed,
        "speed_std": float(spread[0]),
        "froude": speed / math.sqrt(GRAVITY * t.tree.leg),
        "strayed": max(float(w["x_range"][1]) - middle, middle - float(w["x_range"][0])),
        "torso_lean": -math.degrees(float(w["start"][1] + away[1])) - t.slope,
        "torso_sway": math.degrees(float(spread[1])),
        "switches": int(w["switches"]) / seconds,
        "constraint_switches": int(w["constraint_switches"]) / seconds,
    }


def commonest_cycle(t: Trajectory, span: slice) -> dict[str, object]:
    """The commonest sequence of the right leg's states, as the law believed them, between stances, and its share."""
    leg = t.phase[span, 0].astype(int)
    states = [int(leg[0]), *(int(s) for s in leg[1:][np.diff(leg) != 0])]
    cycles: Counter[str] = Counter()
    current: list[int] = []
    for state in states:
        if state == STANCE + 1 and current:
            cycles["-".join(map(str, current))] += 1
            current = []
        current.append(state)
    if not cycles:
        return {"cycle": "-".join(map(str, current)), "share": 1.0}
    cycle, count = cycles.most_common(1)[0]
    return {"cycle": cycle, "share": count / cycles.total()}
