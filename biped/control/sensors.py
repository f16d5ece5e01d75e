"""Sensors of a robot of any kind: measured coordinates, and the mechanics of the model file at them.

Imported only by runs whose scenario has sensors or a truth of its own; without them a law reads the engine's state.
Contacts and their forces are told as they are.
"""

import math

import mujoco
import numpy as np

from biped.robot.robot import Robot
from biped.robot.run import Run
from biped.scenario.devices import Gyro
from biped.scenario.vary import stream

_HINGE = mujoco.mjtJoint.mjJNT_HINGE


class CoordinateSensors:
    """Measurements of one run.

    Args:
        run: The run; its seed fixes noises and zeros.
        model: What the law knows, which is its own: nothing is stepped or in contact in it.
        robot: What it is.
        tick: [s] between measurements.

    Attributes:
        model: As given.
        data: What is measured; with what `mj_step1` computes at it once `compute` has been called.
        past_q: (kept, nq) true coordinates of the latest ticks; that of tick k is row k % kept.
        past_v: (kept, nv) velocities likewise.
        taken: (1,) how many ticks have been taken in.
        zeros: (nv,) [rad] errors of the joints' zeros.
        deviation: (nv,) [m, rad] standard deviation of the noise of every velocity's coordinate.
        rate_deviation: (nv,) [m/s, rad/s] of its rate.
        exact: Whether coordinates have neither.
        places: (n,) the joints' coordinates.
        resolution: [rad] of these; 0: exact.
        gyro: Of the base; None without one.
    """

    def __init__(self, run: Run, model: mujoco.MjModel, robot: Robot, tick: float):
        sensors = run.scenario.sensors
        self.model, self.data = model, mujoco.MjData(model)
        delay = min(round(sensors.delay / tick), run.ticks)
        self.past_q, self.past_v = np.zeros((delay + 1, model.nq)), np.zeros((delay + 1, model.nv))
        self.taken = np.zeros(1, np.int64)
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        place, turning, self._joints = _coordinates(model, robot)
        self._about = np.array(robot.turning_columns)
        self.deviation = np.where(place, sensors.height_noise, np.where(turning, sensors.angle_noise, 0.0))
        self.rate_deviation = np.where(turning, sensors.rate_noise, 0.0)
        self._rng = stream(run.seed, "sensors")
        self.zeros = np.where(self._joints, sensors.zero_error, 0.0) * stream(
            run.seed, "sensors.zeros"
        ).standard_normal(model.nv)
        self.exact = not (self.deviation.any() or self.zeros.any())
        self._columns = np.flatnonzero(self._joints)
        self.places = np.array([model.jnt_qposadr[model.dof_jntid[column]] for column in self._columns], dtype=int)
        self.resolution = float(sensors.quantisation)
        gyro, rate = sensors.gyro, run.scenario.simulation.control_rate
        self.gyro = None if gyro is None else _Gyro(gyro, run.seed, rate, len(self._about))

    def measure(self, q: np.ndarray, v: np.ndarray) -> None:
        """Takes in the true coordinates (nq,) and velocities (nv,) of a tick: late, noisy, rounded."""
        model, data, taken, kept = self.model, self.data, int(self.taken[0]), len(self.past_q)
        self.past_q[taken % kept], self.past_v[taken % kept] = q, v
        late = max(taken + 1 - kept, 0) % kept
        self.taken[0] += 1
        noise, rate_noise = self.noise(1)[0]
        data.qpos[:] = self.past_q[late]
        if not self.exact:
            mujoco.mj_integratePos(model, data.qpos, self.zeros + self.deviation * noise, 1.0)
        data.qvel[:] = self.past_v[late] + self.rate_deviation * rate_noise
        if self.resolution > 0.0:
            data.qpos[self.places] = np.rint(data.qpos[self.places] / self.resolution) * self.resolution
        if self.gyro is not None:
            data.qvel[self._about] = self.gyro.read(v[self._about])

    def noise(self, ticks: int) -> np.ndarray:
        """(ticks, 2, nv) noises of the next ticks, of coordinates and of rates, in their deviations."""
        return self._rng.standard_normal((ticks, 2, self.model.nv))

    def compute(self) -> None:
        """Has MuJoCo compute the mechanics at what is measured: a law that does so itself has no use for them."""
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)


class _Gyro:
    """Reads the base's angular velocity: biased, noisy, clipped, filtered.

    Args:
        gyro: Its keys.
        seed: The run's.
        rate: [Hz] of samples.
        axes: How many.
    """

    def __init__(self, gyro: Gyro, seed: int, rate: float, axes: int):
        self._bias, self._range = math.radians(gyro.bias), math.radians(gyro.range)
        self._deviation, self._follow = gyro.deviation(rate), gyro.follow(rate)
        self._rng, self._axes = stream(seed, "sensors.gyro"), axes
        self._filtered: np.ndarray | None = None

    def read(self, rate: np.ndarray) -> np.ndarray:
        """(axes,) [rad/s] of the true rates."""
        seen = rate + self._bias + self._deviation * self._rng.standard_normal(self._axes)
        seen = np.clip(seen, -self._range, self._range)
        before = seen if self._filtered is None else self._filtered
        self._filtered = filtered = before + self._follow * (seen - before)
        return filtered


def _coordinates(model: mujoco.MjModel, robot: Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(nv,) each: velocities that move the base along, that turn something, and those of hinges that are joints."""
    kinds = model.jnt_type[model.dof_jntid]
    base = np.zeros(model.nv, dtype=bool)
    base[list(robot.base_columns)] = True
    along = np.zeros(model.nv, dtype=bool)
    along[list(robot.moving_columns)] = True
    slides = kinds == mujoco.mjtJoint.mjJNT_SLIDE
    return along, ~along & ~slides, (kinds == _HINGE) & ~base
