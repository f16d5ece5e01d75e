"""The sensors and the estimator of a run; imported only by runs whose scenario has an estimator."""

from __future__ import annotations

import math

import numpy as np

from biped.control.planar.estimator import ESTIMATOR, NOTED, Inference
from biped.robot.planar.topology import LEGS, NU
from biped.robot.planar.tree import Tree
from biped.robot.run import Run
from biped.scenario.senses import Encoders, Estimator, Gyro, Switches
from biped.scenario.vary import stream


class Senses:
    """Sensors and estimator of the robot of one run.

    Args:
        run: The run; its seed fixes noise and the encoders' zeros.
        believed: Lengths that the estimator believes in.
        q: (9,) true joint coordinates, live.
        v: (9,) true joint velocities, live.
        count: Number of control ticks.

    Attributes:
        q: (9,) inferred joint coordinates, live.
        v: (9,) inferred joint velocities, live.
        record: (1,) `biped.control.planar.estimator.ESTIMATOR`.
        noise: (count,) [rad/s] of the gyro.
        noted: (count, NOTED) what is noted of the estimates.
        joints: (6,) measured joint angles, live.
    """

    def __init__(self, run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, count: int):
        s = run.scenario
        sensors, keys = s.sensors, s.estimator or Estimator()
        encoders, gyro = sensors.encoders or Encoders(), sensors.gyro or Gyro()
        switches = sensors.switches or Switches()
        self.q, self.v, self.joints = np.array(q), np.array(v), np.zeros(NU)
        self.noted = np.zeros((count, NOTED))
        rate = s.simulation.control_rate
        self.noise = gyro.deviation(rate) * stream(run.seed, "sensors.gyro").standard_normal(count)
        self.record = np.zeros(1, ESTIMATOR)
        e = self.record[0]
        for name, value in believed._asdict().items():
            e["tree"][name] = value
        e["tick"] = 1.0 / rate
        e["resolution"] = np.radians(encoders.resolution * LEGS)
        zeros = stream(run.seed, "sensors.encoders").standard_normal(NU)
        e["reference"] = np.radians(encoders.reference_error) * zeros
        e["range"], e["bias"] = math.radians(gyro.range), math.radians(gyro.bias)
        e["follow"] = gyro.follow(rate)
        e["force"], e["release"] = switches.force, switches.release
        e["debounce"] = round(switches.debounce * rate)
        e["width"], e["blend"] = keys.width, max(1.0, keys.blend * rate)

    @property
    def inference(self) -> Inference:
        """As loops take it."""
        return Inference(self.record, self.noise, self.noted, self.joints)
