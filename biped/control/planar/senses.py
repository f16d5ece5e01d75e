"""The sensors and the estimator of a run of seven links; imported only by runs whose scenario has either."""

import math

import numpy as np

from biped.control.planar.estimator import ESTIMATOR, NOTED, Inference
from biped.control.planar.loop import measure
from biped.robot.planar.topology import LEGS, NQ, NU, PITCH
from biped.robot.planar.tree import Tree
from biped.robot.run import Run
from biped.scenario.devices import Encoders, Estimator, Gyro, Switches
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
        angle_noise: (count, 6) [rad] of the encoders, or (0, 6).
        past: (delay + 1, 2, 9) latest true coordinates and velocities.
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
        noisy = stream(run.seed, "sensors.encoders.noise").standard_normal((count if sensors.angle_noise else 0, NU))
        self.angle_noise = sensors.angle_noise * noisy
        self.past = np.zeros((round(sensors.delay * rate) + 1, 2, NQ))
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
        return Inference(self.record, self.noise, self.angle_noise, self.past, self.noted, self.joints)


class PlanarSensors:
    """Measured coordinates of one run.

    Args:
        run: The run; its seed fixes the noise.
        q: (9,) true joint coordinates, live.
        v: (9,) true joint velocities, live.
        count: Number of control ticks.

    Attributes:
        q: (9,) measured joint coordinates, live.
        v: (9,) measured joint velocities, live.
        noise: (2, count, 9) normal numbers of coordinates and velocities; by `deviation` they are what is added.
        deviation: (2, 9) [m, rad; m/s, rad/s].
        past: (delay + 1, 2, 9) latest true coordinates and velocities.
        resolution: [rad] of the angles; 0: exact.
    """

    def __init__(self, run: Run, q: np.ndarray, v: np.ndarray, count: int):
        s = run.scenario
        sensors = s.sensors
        self._true_q, self._true_v = q, v
        self.q, self.v = np.array(q), np.array(v)
        rng = stream(run.seed, "sensors")
        self.noise = rng.standard_normal((2, count, 9))
        self.deviation = np.array([
            [sensors.height_noise] * PITCH + [sensors.angle_noise] * (NQ - PITCH),
            [0.0] * PITCH + [sensors.rate_noise] * (NQ - PITCH),
        ])  # fmt: skip
        self.past = np.zeros((round(sensors.delay * s.simulation.control_rate) + 1, 2, 9))
        self.resolution = float(sensors.quantisation)

    def measure(self, k: int) -> None:
        """Updates the measurements at control tick k."""
        past, resolution = self.past, self.resolution
        measure(k, self._true_q, self._true_v, self.noise, self.deviation, past, resolution, self.q, self.v)
