"""Whether a robot of any kind has fallen: its base is too low above the ground, or leans too far."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from biped.robot.ground import Profile
from biped.robot.robot import Robot
from biped.scenario.keys import Fall

_STILL = 0.2
"""[m/s] below which a fall has no direction."""


class Upright:
    """Judges.

    Args:
        model: What is stepped.
        data: Its state, that of the start.
        robot: What it is.
        fall: What counts as a fall.
        ground: The line of the ground.

    Attributes:
        least: [m] height of the base's centre of mass below which it has fallen.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, fall: Fall, ground: Profile):
        self._data, self._robot, self._fall, self._ground = data, robot, fall, ground
        self._number = robot.trunk_number
        self._up = -np.array(model.opt.gravity) / np.linalg.norm(model.opt.gravity)
        mujoco.mj_kinematics(model, data)
        self.least = fall.height * self._height()

    def _height(self) -> float:
        place = self._data.xipos[self._number]
        return float(place[2]) - float(self._ground.height(place[0]))

    def fallen(self, velocity: np.ndarray, time: float) -> tuple[str, str] | None:
        """How it ended, and in words; None as long as it is up.

        Args:
            velocity: (3,) [m/s] of the centre of mass.
            time: [s].
        """
        axis = self._data.xmat[self._robot.base_number].reshape(3, 3) @ self._robot.upright
        lean = math.degrees(math.acos(float(np.clip(axis @ self._up, -1.0, 1.0))))
        if self._height() >= self.least and lean <= self._fall.tilt:
            return None
        # A base held upright over toppling legs falls the way it moves; otherwise the way it leans.
        forward, left = (velocity if lean <= self._fall.tilt else axis)[:2]
        if max(abs(forward), abs(left)) < _STILL:
            return "fell", f"collapsed at {time:.3f} s"
        if abs(left) > abs(forward):
            return "fell", f"fell to the {'left' if left > 0.0 else 'right'} at {time:.3f} s"
        return "fell", f"fell {'forward' if forward > 0.0 else 'backward'} at {time:.3f} s"
