"""Speed, steps and leg states."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from biped.measure.metrics.sums import Sums
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY
from biped.robot.leg_states import FIRST_IN_AIR, STANCE
from biped.robot.topology import HEEL, LEGS

_AIR = FIRST_IN_AIR + 1
"""Leg states from this on are in the air."""


MOVED = 0.1
"""[m] that must be travelled in the window for numbers per distance."""
_BOUNCE = 0.05
"""[s] in the air below which a foot has only bounced."""


def strikes(phase: np.ndarray, tick: float) -> list[tuple[int, int]]:
    """Foot strikes (row, leg), in time order: a leg comes down after the other leg's last strike or its own swing.

    Args:
        phase: (n, 2) leg states 1 … 4.
        tick: [s] between rows.

    A foot that bounces in place does not count again: a strike ends a time in the air of at least 0.05 s.
    """
    found, least = [], round(_BOUNCE / tick)
    for leg in range(LEGS):
        air = phase[:, leg] >= _AIR
        edges = np.flatnonzero(np.diff(air.astype(int)))
        starts = {row + 1 for row in edges if not air[row]}
        began = 0 if air[0] else None
        for row in edges + 1:
            if row in starts:
                began = row if began is None else began
            elif began is not None:
                if row - began >= least:
                    found.append((int(row), leg))
                began = None
    return sorted(found)


def travelled(sums: Sums) -> float:
    """Distance [m] over the window that costs and slip are divided by; nan for one that got nowhere.

    A robot that stands has no cost of transport: what it spends over the centimetres that it sways is no number.
    """
    start, end = sums.window["x"].tolist()
    return abs(end - start) if abs(end - start) >= MOVED else math.nan


def stride(t: Trajectory, sums: Sums) -> dict[str, float]:
    """Speed, Froude number, step length and frequency, support phases, lean and switching over the window."""
    w, span = sums.window, sums.span
    rows, (start, end), (began, ended) = int(w["rows"]), w["x"].tolist(), w["time"].tolist()
    seconds = ended - began or math.nan  # a run that ended in its first tick has no rates
    speed = (end - start) / seconds
    steps = strikes(t.phase[span], t.tick)
    place = sums.point[span, :, 0]
    legs = np.array([leg for _, leg in steps])
    lengths = [abs(place[row, HEEL[leg]] - place[row, HEEL[1 - leg]]) for row, leg in steps]
    flight, _, double = w["standing"] / rows
    away = w["away"] / rows
    spread = np.sqrt(np.maximum(w["away_squared"] / rows - away**2, 0.0))
    middle = float(w["x_sum"]) / rows
    return {
        "speed": speed,
        "speed_std": float(spread[0]),
        "froude": speed / math.sqrt(GRAVITY * t.tree.leg),
        "step_length": float(np.mean(lengths)) if lengths else math.nan,
        "step_frequency": len(steps) / seconds,
        "steps": len(steps),
        "alternation": float(np.mean(legs[1:] != legs[:-1])) if len(legs) > 1 else math.nan,
        "strayed": max(float(w["x_range"][1]) - middle, middle - float(w["x_range"][0])),
        "double_support": float(double),
        "flight": float(flight),
        "torso_lean": -math.degrees(float(w["start"][1] + away[1])) - t.slope,
        "torso_sway": math.degrees(float(spread[1])),
        "switches": int(w["switches"]) / seconds,
        "constraint_switches": int(w["constraint_switches"]) / seconds,
    }


def commonest_cycle(t: Trajectory, span: slice) -> dict[str, object]:
    """The commonest sequence of right-leg states from one stance to the next, and its share of all cycles."""
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
