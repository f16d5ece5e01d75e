"""Sensors between the biped and the controller: noise, delay and resolution of the measured coordinates.

Imported only by runs whose scenario has sensors; without them the controller reads the engine's state itself.
"""

from __future__ import annotations

import numpy as np

from biped.control.planar.loop import measure
from biped.robot.planar.topology import NQ, PITCH
from biped.robot.run import Run
from biped.scenario.vary import stream


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
