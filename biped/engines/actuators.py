"""Actuators between a law and the physics, with bounds, lag and delay; and the work of what acts on the robot."""

import math

import mujoco
import numpy as np

from biped.base.jit import kernel
from biped.robot.run import Run
from biped.scenario.vary import stream


@kernel
def actuate(command, limits, follow, wanted, target):
    """Brings actuators towards what a law commands; returns whether that is finite, and otherwise does nothing.

    Args:
        command: (n,) what the law returned.
        limits: (n,) [N m] bounds of torques; inf of other commands.
        follow: Fraction of the way that actuators go in a tick.
        wanted: (n,) where they are, overwritten.
        target: (n,) what MuJoCo takes commands from, overwritten.
    """
    for j in range(command.size):
        if not math.isfinite(command[j]):
            return False
    for j in range(command.size):
        bounded = min(max(command[j], -limits[j]), limits[j])
        wanted[j] += follow * (bounded - wanted[j])
        target[j] = wanted[j]
    return True


class Latency:
    """Commands under way in one run; one that comes after a later one is dropped.

    Args:
        run: The run; its seed fixes what is drawn for each tick.
    """

    def __init__(self, run: Run):
        actuation = run.scenario.actuation
        self._least, self._more = round(actuation.delay / run.tick), round(actuation.delay_jitter / run.tick)
        self._rng = stream(run.seed, "actuation.delay")
        self._way: list[tuple[int, np.ndarray]] = []

    def pass_on(self, k: int, command: np.ndarray) -> np.ndarray:
        """Sends the command of tick k on its way, and returns the latest that has arrived; the first does at once."""
        jitter = int(self._rng.random() * (self._more + 1)) if self._more else 0
        self._way.append((k + self._least + jitter, command.copy()))
        newest = max((i for i, (arrival, _) in enumerate(self._way) if arrival <= k), default=0)
        del self._way[:newest]
        return self._way[0][1]


class Account:
    """Adds up work: force times the mean of the velocities before and after, which for a step of Euler is exact.

    Args:
        model: What is stepped.
        data: Its state.

    Attributes:
        work: [J] of actuators, pushes, dampers, contacts and stops since `begin`.
        given: [J] of actuators and pushes alone.
        half: [s] of a step.
        damping: (nv,) [N m s/rad] of the joints.
        other: Whether there are dampers besides.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData):
        self._model, self._data = model, data
        self._before = np.empty(model.nv)
        self._pushed, self._step, self._force = (np.zeros(model.nv) for _ in range(3))
        self.half = 0.5 * model.opt.timestep
        self._bodies: list[int] = []
        self._rows = np.empty((3, model.nv))
        damping = model.dof_damping
        self.damping = np.array(damping if damping.ndim == 1 else damping[:, 0])
        # Tendons' dampers and dampers that are not linear: few robots have any.
        self.other = bool(model.tendon_damping.any() or model.tendon_dampingpoly.any() or model.dof_dampingpoly.any())
        self._poly = np.array(model.dof_dampingpoly)
        self.work = self.given = 0.0

    def push(self) -> None:
        """Notes which bodies are pushed from now on."""
        self._bodies = np.flatnonzero(self._data.xfrc_applied.any(axis=1)).tolist()

    def begin(self) -> None:
        """A tick begins."""
        self.work = self.given = 0.0

    def before(self) -> None:
        """A step begins, whose positions are known."""
        self._before[:] = self._data.qvel
        if self._bodies:
            self._pushed[:] = 0.0
        for body in self._bodies:
            mujoco.mj_jacBodyCom(self._model, self._data, self._rows, None, body)
            self._pushed += self._data.xfrc_applied[body, :3] @ self._rows

    def of_steps(self, step: np.ndarray, force: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n,) [J] each: `work` and `given` of ticks whose steps something else has taken, in the digits of `after`.

        Args:
            step: (n, substeps, nv) mean velocities of each step, times its length.
            force: (n, substeps, nv) of actuators, and whatever is applied to coordinates.
            rest: (n, substeps, nv) of contacts, stops and dampers.
        """
        given, other = np.vecdot(force, step), np.vecdot(rest, step)
        total, work = np.zeros(len(step)), np.zeros(len(step))
        for i in range(step.shape[1]):
            total += given[:, i]
            work += given[:, i] + other[:, i]
        return work, total

    def after(self) -> None:
        """It is done."""
        data, after, step, force = self._data, self._data.qvel, self._step, self._force
        np.add(self._before, after, step)
        np.multiply(step, self.half, step)
        np.add(data.qfrc_actuator, data.qfrc_applied, force)
        if self._bodies:
            np.add(force, self._pushed, force)
        given = float(force @ step)
        self.given += given
        # MuJoCo's dampers act with the velocity after the step.
        np.multiply(self.damping, after, force)
        np.subtract(data.qfrc_constraint, force, force)
        self.work += given + float(force @ step)
        if self.other:
            # They act with their force before the step and its slope there.
            quadratic, cubic = self._poly.T
            slope = 2.0 * quadratic * np.abs(self._before) + 3.0 * cubic * self._before**2
            damper = data.qfrc_damper + self.damping * self._before - slope * (after - self._before)
            self.work += float(damper @ step)
