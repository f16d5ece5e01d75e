"""Speed, steps and support phases: by the true state and the ground's force alone."""

import math
from collections.abc import Sequence

import numpy as np

from biped.measure.contact import along_feet
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY
from biped.scenario.command import COMMANDED

MOVED = 0.1
"""[m] that must be travelled in the window for numbers per distance."""


def travelled(t: Trajectory, span: slice) -> float:
    """Distance [m] over a span that costs and slip are divided by; nan for one that got nowhere.

    A robot that stands has no cost of transport: what it spends over the centimetres that it sways is no number.
    """
    far = math.hypot(*(float(way[span.stop - 1] - way[span.start]) for way in (t.x, t.y)))
    return far if far >= MOVED else math.nan


def heels(t: Trajectory, rows: np.ndarray) -> np.ndarray:
    """(m, 2) [m] places of the heels along the ground in some rows: the middle of the rear half of a foot's points."""
    feet, rear = t.robot.of_foot, along_feet(t.robot) < 0.5
    place = t.point[rows, :, 0]
    return np.stack([place[:, (feet == foot) & rear].mean(axis=1) for foot in range(len(t.robot.feet))], axis=1)


def stride(t: Trajectory, span: slice) -> dict[str, float]:
    """Speed, Froude number, steps, support phases and lean over a span of rows."""
    x, y, time, moving, lean = t.x[span], t.y[span], t.time[span], t.forward_speed[span], np.degrees(t.lean[span])
    seconds = float(time[-1] - time[0]) or math.nan  # a run that ended in its first tick has no rates
    speed = float(x[-1] - x[0]) / seconds
    strayed = (x - x.mean()) ** 2 + (y - y.mean()) ** 2
    return {
        "speed": speed,
        "speed_std": float(moving.std()),
        "froude": speed / math.sqrt(GRAVITY * t.robot.leg),
        "strayed": math.sqrt(float(strayed.max())),
        "torso_lean": float(lean.mean()),
        "torso_sway": float(lean.std()),
        "tilt": float(np.degrees(t.tilt[span].max())),
        **_steps(t, span),
    }


def _steps(t: Trajectory, span: slice) -> dict[str, float]:
    """Steps and support phases."""
    down, found = t.down[span], t.strikes_in(span)
    rows, feet = np.array(found, dtype=int).reshape(-1, 2).T
    heel, (right, left) = heels(t, rows), down.T
    return {
        "step_length": mean_of(np.abs(heel[:, 0] - heel[:, 1])),
        "step_frequency": steps_per_second(rows, t.tick),
        "step_duration": mean_of(t.tick * np.diff(rows)),
        "steps": len(found),
        "alternation": mean_of(feet[1:] != feet[:-1]),
        "double_support": float((right & left).mean()),
        "flight": 1.0 - float((right | left).mean()),
        "duty": float(down.mean()),
    }


def steps_per_second(rows: np.ndarray, tick: float) -> float:
    """Steps from the first strike to the last, per second, so that length times frequency is speed; 0 of less than two.

    Args:
        rows: (n,) rows of the strikes.
        tick: [s] from row to row.
    """
    return (len(rows) - 1) / (tick * float(rows[-1] - rows[0])) if len(rows) > 1 and rows[-1] > rows[0] else 0.0


def mean_of(values: Sequence[float] | np.ndarray) -> float:
    """The mean of some numbers; nan of none."""
    return float(np.mean(values)) if len(values) else math.nan


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
    place, turn = t.base[span, :2], t.robot.heading(t.turn)[span]
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
