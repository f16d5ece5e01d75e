"""The state of a robot of any kind at a tick, as a row of its trajectory has it."""

from __future__ import annotations

import mujoco
import numpy as np

from biped.control.general.sensed import Sensed
from biped.robot.robot import Robot


class Notes:
    """Writes rows.

    Args:
        model: What is stepped.
        data: Its state, with what `mj_step1` computes.
        robot: What it is.
        parts: Columns of a trajectory's quantities.

    Attributes:
        anchors: Joints that a stick figure shows: hip, knee and ankle of each leg.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, parts: dict[str, slice]):
        self._model, self._data, self._robot, self._parts = model, data, robot, parts
        legs = [foot.joints for foot in robot.feet]
        self.anchors = [joints[min(i, len(joints) - 1)] if joints else 0 for joints in legs for i in range(3)]
        self._without = [(3 * foot + i, foot) for foot, joints in enumerate(legs) for i in range(len(joints), 3)]
        self._feet = robot.of_foot

    def write(self, line: np.ndarray, true: Sensed, time: float) -> None:
        """Writes the state at a time [s] into a row.

        Args:
            line: The row.
            true: What is true, contacts included.
            time: [s].
        """
        data, base = self._data, self._robot.base_number
        for name, values in (
            ("time", time), ("q", data.qpos), ("v", data.qvel), ("point", true.points.ravel()),
            ("contact", true.touching), ("com", true.com), ("com_velocity", true.com_velocity),
            ("base", np.concatenate([data.xpos[base], data.xquat[base]])), ("energy", self._energy()),
            ("figure", self._figure(true.points)),
        ):  # fmt: skip
            line[self._parts[name]] = values

    def _figure(self, points: np.ndarray) -> np.ndarray:
        """(21,) [m] joints of the legs and the trunk's end, for a stick figure."""
        data, robot = self._data, self._robot
        out = np.empty((7, 3))
        out[:6] = data.xanchor[self.anchors]
        for row, foot in self._without:  # a foot on no ankle
            out[row] = points[self._feet == foot].mean(axis=0)
        out[6] = data.xpos[robot.base_number] + data.xmat[robot.base_number].reshape(3, 3) @ robot.top
        return out.ravel()

    def _energy(self) -> float:
        """[J] potential and kinetic; the rotors' included."""
        mujoco.mj_energyPos(self._model, self._data)
        mujoco.mj_energyVel(self._model, self._data)
        return float(self._data.energy.sum())
