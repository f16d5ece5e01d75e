"""Metrics of a run that was asked for a velocity: how far what it did is from that."""

from __future__ import annotations

import numpy as np

from biped.measure.metrics.space import headings
from biped.measure.trajectory import Trajectory
from biped.scenario.command import COMMANDED

SECOND = 1.0
"""[s] over which velocities are averaged: within a step they go to and fro."""


def tracking(t: Trajectory, span: slice) -> dict[str, float]:
    """Velocity that was asked for and errors of what came of it, over a span of rows; nothing if none was asked for.

    The base's velocity, in the direction that it faces, and its turning are means over pieces of a second; errors are
    root mean squares over these.

    Args:
        t: The run.
        span: Rows.
    """
    if COMMANDED[0] not in t.signals:
        return {}
    asked = np.stack([t.signals[name][span] for name in COMMANDED], axis=1)
    place, turn = t.base[span, :2], np.zeros(len(t.time[span])) if t.robot.planar else headings(t)[span]
    moved = np.diff(place, axis=0) / t.tick
    c, s = np.cos(turn[:-1]), np.sin(turn[:-1])
    done = np.stack(
        [c * moved[:, 0] + s * moved[:, 1], c * moved[:, 1] - s * moved[:, 0], np.diff(turn) / t.tick], axis=1
    )
    pieces = np.array_split(done - asked[:-1], max(1, round(len(done) * t.tick / SECOND)))
    off = np.array([piece.mean(axis=0) for piece in pieces])
    return {
        "commanded": float(np.linalg.norm(asked[:, :2], axis=1).mean()),
        "command_error": float(np.sqrt((off[:, :2] ** 2).sum(axis=1).mean())),
        "yaw_error": float(np.sqrt((off[:, 2] ** 2).mean())),
    }
