"""What stands between the biped and the controller: noise, delay and resolution of the measured coordinates.

Imported only by runs whose scenario has sensors; without them the controller reads the engine's state itself.
"""

from __future__ import annotations

import numpy as np

from biped.robot.run import Run
from biped.scenario.vary import stream


class Sensors:
    """Measured coordinates of one run.

    Args:
        run: The run; its seed fixes the noise.
        q: (9,) true joint coordinates, live.
        v: (9,) true joint velocities, live.
        count: Number of control ticks.

    Attributes:
        q: (9,) measured joint coordinates, live.
        v: (9,) measured joint velocities, live.
    """

    def __init__(self, run: Run, q: np.ndarray, v: np.ndarray, count: int):
        s = run.scenario
        sensors = s.sensors
        self._true_q, self._true_v = q, v
        self.q, self.v = np.array(q), np.array(v)
        rng = stream(run.seed, "sensors")
        scale = np.array([sensors.height_noise] * 2 + [sensors.angle_noise] * 7)
        self._noise_q = rng.standard_normal((count, 9)) * scale
        self._noise_v = rng.standard_normal((count, 9)) * np.array([0.0] * 2 + [sensors.rate_noise] * 7)
        self._delay = round(sensors.delay * s.simulation.control_rate)
        self._past = np.zeros((self._delay + 1, 2, 9))
        self._step = sensors.quantisation

    def measure(self, k: int) -> None:
        """Updates the measurements at control tick k."""
        size = self._delay + 1
        if k == 0:
            self._past[:] = self._true_q, self._true_v
        self._past[k % size] = self._true_q, self._true_v
        q, v = self._past[(k + 1) % size]
        np.add(q, self._noise_q[k], out=self.q)
        np.add(v, self._noise_v[k], out=self.v)
        if self._step > 0.0:
            self.q[2:] = np.round(self.q[2:] / self._step) * self._step
