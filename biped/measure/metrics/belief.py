"""Metrics of the law's belief: changes of its leg states and of its rows in A. A run is judged by none of them."""

import math
from collections import Counter

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.leg_states import STANCE


def switches(t: Trajectory, span: slice) -> dict[str, float]:
    """Changes of leg states and of rows in A per second, of a law that logs them."""
    time, states = t.time[span], t.believed_states
    seconds = float(time[-1] - time[0]) or math.nan
    out = {}
    if states is not None:
        out["switches"] = int(np.count_nonzero(np.diff(states[span], axis=0))) / seconds
    if "active" in t.columns:
        changed = [row[1:] != row[:-1] for row in t.active[span].T]
        out["constraint_switches"] = int(np.count_nonzero(np.logical_or.reduce(changed))) / seconds
    return out


def commonest_cycle(states: np.ndarray) -> dict[str, object]:
    """The commonest sequence of a leg's states from one stance to the next, and its share of all cycles.

    Args:
        states: (n,) leg states 1 … 4, as the law believed them.
    """
    leg = states.astype(int)
    changes = [int(leg[0]), *(int(s) for s in leg[1:][np.diff(leg) != 0])]
    cycles: Counter[str] = Counter()
    current: list[int] = []
    for state in changes:
        if state == STANCE + 1 and current:
            cycles["-".join(map(str, current))] += 1
            current = []
        current.append(state)
    if not cycles:
        return {"cycle": "-".join(map(str, current)), "share": 1.0}
    cycle, count = cycles.most_common(1)[0]
    return {"cycle": cycle, "share": count / cycles.total()}


def inferred(t: Trajectory, span: slice) -> dict[str, float]:
    """Errors of the inferred torso angle over a span of rows, and what it rested on; nothing without an estimator."""
    if t.inferred is None:
        return {}
    pitch, _, gyro, clipped = t.inferred[span].T
    error = np.degrees(pitch - t.q[span, t.robot.base_columns[-1]])
    edges = np.diff(np.concatenate([[0], (gyro > 0.0).astype(int), [0]]))
    gaps = np.flatnonzero(edges < 0) - np.flatnonzero(edges > 0)
    return {
        "torso_error": math.sqrt(float((error**2).mean())),
        "torso_error_worst": float(np.abs(error).max()),
        "underactuated": float(gyro.mean()),
        "longest_gap": float(gaps.max(initial=0)) * t.tick,
        "gyro_clipped": float(clipped.mean()),
    }
