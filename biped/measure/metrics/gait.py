"""Speed, steps and leg states."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.leg_states import FIRST_IN_AIR, STANCE
from biped.robot.model import GRAVITY
from biped.robot.topology import HEEL, LEGS, PITCH, TOE
from biped.robot.tree import Motion

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


def travelled(t: Trajectory, span: slice) -> float:
    """Distance [m] over a span of rows that costs and slip are divided by; nan for one that got nowhere.

    A robot that stands has no cost of transport: what it spends over the centimetres that it sways is no number.
    """
    distance = abs(float(t.q[span, 0][-1] - t.q[span, 0][0]))
    return distance if distance >= MOVED else math.nan


def stride(t: Trajectory, whole: Motion, span: slice) -> dict[str, float]:
    """Speed, Froude number, step length and frequency, support phases, lean and switching over a span of rows."""
    x, vx, time = t.q[span, 0], t.v[span, 0], t.time[span]
    seconds = float(time[-1] - time[0]) or math.nan  # a run that ended in its first tick has no rates
    speed = float(x[-1] - x[0]) / seconds
    phase, believed, active = t.phase[span], t.believed[span], t.active[span]
    steps = strikes(phase, t.tick)
    place = whole.point[span, :, 0]
    legs = np.array([leg for _, leg in steps])
    lengths = [abs(place[row, HEEL[leg]] - place[row, HEEL[1 - leg]]) for row, leg in steps]
    right, left = (believed[:, [toe, heel]].any(axis=1) for toe, heel in zip(TOE, HEEL, strict=True))
    lean = -np.degrees(t.q[span, PITCH]) - t.slope
    return {
        "speed": speed,
        "speed_std": float(np.std(vx)),
        "froude": speed / math.sqrt(GRAVITY * t.tree.leg),
        "step_length": float(np.mean(lengths)) if lengths else math.nan,
        "step_frequency": len(steps) / seconds,
        "steps": len(steps),
        "alternation": float(np.mean(legs[1:] != legs[:-1])) if len(legs) > 1 else math.nan,
        "strayed": float(np.abs(x - x.mean()).max()),
        "double_support": float(np.mean(right & left)),
        "flight": float(np.mean(~right & ~left)),
        "torso_lean": float(np.mean(lean)),
        "torso_sway": float(np.std(lean)),
        "switches": float(np.count_nonzero(np.diff(phase, axis=0))) / seconds,
        "constraint_switches": float(np.count_nonzero(np.diff(active, axis=0).any(axis=1))) / seconds,
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
