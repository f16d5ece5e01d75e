"""How well a robot knew its posture."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.trajectory import Trajectory


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
