"""The outcome of a run, and means of a law's own signals; of robots of any kind."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from biped.measure.metrics import walking
from biped.measure.trajectory import Trajectory
from biped.measure.verdict import DIVERGENT, DOUBTFUL, SOUND


def outcome_of(t: Trajectory, numbers: dict[str, Any], verdict: str, seconds: float) -> dict[str, int]:
    """The outcome of a run and the verdict on its numbers, each 0 or 1.

    A fall is a fall whatever the verdict; only a run with sound numbers can have walked, stood or sat.

    Args:
        t: The run.
        numbers: Its metrics.
        verdict: On its numbers (`biped.measure.verdict`).
        seconds: Length of the window.
    """
    up = t.end == "completed" and verdict == SOUND
    return {
        "falls": int(t.end == "fell" or verdict == DIVERGENT),
        "diverged": int(verdict == DIVERGENT),
        "doubtful": int(verdict == DOUBTFUL),
        "walked": int(up and walking.walked(numbers, len(t) * t.tick, t.robot.walked)),
        "stood": int(up and walking.stood(numbers, seconds)),
        "sat": int(up and walking.sat(numbers, seconds)),
    }


def stopped(t: Trajectory, outcome: dict[str, int]) -> dict[str, float]:
    """How far [m] a run that stood at last went from its first change on; nothing of others."""
    if not (t.changes and outcome["stood"]):
        return {}
    told = min(int(np.searchsorted(t.time, t.changes[0] - 1e-9)), len(t) - 1)
    return {"stopping_distance": float(t.x[-1] - t.x[told])}


def spread(values: np.ndarray) -> dict[str, float]:
    """Mean, smallest and largest of the numbers among values (n,); nan if there are none."""
    real = values[np.isfinite(values)]
    if not len(real):
        return dict.fromkeys(("mean", "min", "max"), math.nan)
    return {"mean": float(real.mean()), "min": float(real.min()), "max": float(real.max())}
