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
    return standing(t, np.tile([True, False], (len(t), 1)))


def standing(t: Trajectory, down: np.ndarray) -> Trajectory:
    """The run with its weight on the feet (n, 2) that are down, half of a foot's on the toe and half on the heel."""
    share = down / np.maximum(down.sum(axis=1, keepdims=True), 1)
    t.column("force")[:, :, 1] = 0.5 * WEIGHT * np.repeat(share, 2, axis=1)
    return t


def lifted(n: int, *swings: tuple[int, int, int]) -> np.ndarray:
    """(n, 2) both feet down but for swings (first row, row of the strike, foot)."""
    down = np.ones((n, 2), dtype=bool)
    for start, end, foot in swings:
        down[start:end, foot] = False
    return down
