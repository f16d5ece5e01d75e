"""The walk as numbers that a browser draws: where hips, knees, ankles, toes and heels are, forces, and leg states."""

from __future__ import annotations

import base64
import math
from typing import Any, NamedTuple

import numpy as np

from biped.measure.signals import corners_of, end_forces, finite, leg_states, means, stick
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY

RATE = 40.0
"""Pictures per second."""
LONGEST = 12.0
"""[s] of a run that are shown: of one that did not stay up the last, otherwise the first, pushes included."""
UNIT = 5e-4
"""[m] of the whole numbers that places are told in."""
NAMES = ("hip", "knee", "ankle", "toe", "heel")
"""Points of a leg, in order; after both legs come the torso's top and the centre of mass of the whole biped."""


class Frames(NamedTuple):
    """A walk, picture by picture.

    Attributes:
        time: (n,) [s].
        place: (n, 12, 2) [m] points of the right leg, of the left, the torso's top, the centre of mass; gravity is
            vertical, the ground rises with the slope.
        force: (n, 4, 2) [body weights] on toes and heels, likewise turned.
        state: (n, 2) leg states 1 … 4.
        slope: [degrees].
        leg: [m] length of a leg.
        pushes: (start, end, forward [N], up [N], body).
        legs: What people call the legs.
        ground: (k, 2) [m] the ground's line around the walk, likewise turned.
        seat: (4, 2) [m] corners of what it can sit on, likewise turned; (0, 2) without a seat.
    """

    time: np.ndarray
    place: np.ndarray
    force: np.ndarray
    state: np.ndarray
    slope: float
    leg: float
    pushes: tuple[tuple[float, float, float, float, str], ...]
    legs: tuple[str, ...]
    ground: np.ndarray
    seat: np.ndarray

    def data(self) -> dict[str, Any]:
        """As the page's script reads it: places in `UNIT`, relative to the torso's foot point, forces in 1/1000."""
        along = self.place[:, -1, :1]
        base = np.concatenate([along, along * math.tan(math.radians(self.slope))], axis=1)  # the ground below
        return {
            "dt": 1.0 / RATE,
            "start": round(float(self.time[0]), 4),
            "n": len(self.time),
            "unit": UNIT,
            "slope": self.slope,
            "leg": round(self.leg, 4),
            "base": _packed(along[:, 0], "<f4"),
            "place": _packed((self.place - base[:, None]) / UNIT, "<i2"),
            "force": _packed(1e3 * self.force, "<i2"),
            "state": _packed(self.state, "u1"),
            "pushes": [[round(value, 4) for value in (*push[:3], push[-2])] for push in self.pushes],
        }


def frames_of(trajectory: Trajectory) -> Frames:
    """Pictures of a run."""
    trajectory = finite(trajectory)
    stride = max(1, round(1.0 / (RATE * trajectory.tick)))
    rows = np.arange(0, len(trajectory), stride)
    most = round(LONGEST * RATE)
    if trajectory.end == "completed":
        last = max([LONGEST, *(push[1] + 2.0 for push in trajectory.pushes)])
        rows = rows[trajectory.time[rows] <= last]
    rows = rows[-most:]
    slope = math.radians(trajectory.slope)
    turn = np.array([[math.cos(slope), math.sin(slope)], [-math.sin(slope), math.cos(slope)]])
    weight = trajectory.mass * GRAVITY
    force = np.clip(means(end_forces(trajectory), rows) / weight, -30.0, 30.0)
    along = trajectory.x[rows]
    reach = 4.0 * trajectory.robot.leg
    return Frames(
        time=trajectory.time[rows],
        place=stick(trajectory, rows) @ turn,
        force=force @ turn,
        state=leg_states(trajectory)[rows].astype(int),
        slope=trajectory.slope,
        leg=trajectory.robot.leg,
        pushes=trajectory.pushes,
        legs=trajectory.robot.legs,
        ground=np.stack(trajectory.ground.between(along.min() - reach, along.max() + reach), axis=1) @ turn,
        seat=corners_of(trajectory) @ turn,
    )


def _packed(values: np.ndarray, kind: str) -> str:
    whole = values if kind == "<f4" else np.clip(np.rint(values), *((-32767, 32767) if kind == "<i2" else (0, 255)))
    return base64.b64encode(np.ascontiguousarray(whole.astype(kind)).tobytes()).decode()
