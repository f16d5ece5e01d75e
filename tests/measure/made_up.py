"""Runs that nobody simulated, whose metrics are known."""

from __future__ import annotations

import numpy as np

from biped.measure.trajectory import Trajectory
from tests.runs import synthetic

WEIGHT = 75.0 * 9.81


def steady(**columns):
    """Two seconds at 0.5 m/s with upright legs; feet at q's places."""
    n = 2000
    q, v = np.zeros((n, 9)), np.zeros((n, 9))
    q[:, 0], q[:, 1], v[:, 0] = 0.5 * np.arange(n) * 0.001, 1.3, 0.5
    return synthetic(2.0, q=q, v=v, **columns)


def borne(t: Trajectory) -> Trajectory:
    """The run with its weight on the right foot and no energy that comes from nowhere."""
    t.column("believed")[:, :2] = 1.0
    t.column("force")[:, :2, 1] = 0.5 * WEIGHT
    return t
