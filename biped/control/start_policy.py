"""The policy of my_policy.toml in Python, for what no card can say: change `observe`, or what becomes of the action.

    biped run policy/h1 --set law=my_policy.py:MyPolicy

Everything that it may read: docs/controllers.md.
"""

from pathlib import Path

import numpy as np
from onnxruntime import InferenceSession

LEG = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle")
JOINTS = [f"{side}_{name}" for side in ("left", "right") for name in LEG]
DEFAULT = np.array([0.0, 0.0, -0.31, 0.8, -0.49] * 2)  # rad
STIFFNESS, DAMPING = [150.0, 200.0, 200.0, 250.0, 40.0] * 2, [5.0, 6.0, 6.0, 6.0, 2.0] * 2  # N m/rad, N m s/rad
RATE, SCALE, STRIDES = 50.0, 0.5, 2.0  # Hz of calls, rad of an action of 1, Hz of the phase


class MyPolicy:
    """Called once before every run, then at every tick for the torques of all actuators."""

    def __init__(self, setup):
        robot, self.network = setup.robot, InferenceSession(Path(__file__).with_name("my_policy.onnx"))
        self.places, self.columns = robot.places, robot.columns
        self.own = [[drive.joint for drive in robot.drives].index(name) for name in JOINTS]
        self.target = setup.q[self.places].copy()
        self.k, self.b = np.full(len(self.target), 250.0), np.full(len(self.target), 6.0)  # the other joints are held
        self.k[self.own], self.b[self.own] = STIFFNESS, DAMPING
        self.ticks, self.every, self.action = 0, round(1.0 / (RATE * setup.tick)), np.zeros(10)

    def observe(self, sensed):
        """(k,) what the network sees: velocities and gravity in the base's frame."""
        base, phase = sensed.frame(sensed.robot.base), 2.0 * np.pi * STRIDES * sensed.time
        joints, rates = sensed.q[self.places][self.own], sensed.v[self.columns][self.own]
        return np.concatenate([base.velocity, 0.25 * base.angular_velocity, -base.orientation[2], joints - DEFAULT,
                               0.05 * rates, self.action, sensed.command, [np.sin(phase), np.cos(phase)]])  # fmt: skip

    def torques(self, sensed):
        """(nu,) [N m] of servos that are held to what the network asked for last."""
        if self.ticks % self.every == 0:
            seen = self.observe(sensed)[None].astype(np.float32)
            self.action = np.asarray(self.network.run(None, {"observation": seen})[0])[0]
            self.target[self.own] = DEFAULT + SCALE * self.action
        self.ticks += 1
        return self.k * (self.target - sensed.q[self.places]) - self.b * sensed.v[self.columns]
