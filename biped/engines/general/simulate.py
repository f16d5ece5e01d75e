"""A run of a robot of any kind in MuJoCo: sense, ask the law, step; until it ends, falls or is not finite."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from biped.control.general.law import Asked, Setup, command_of, maker_of
from biped.control.general.sensed import Sensed
from biped.control.law import Raised
from biped.engines.general.account import Account
from biped.engines.general.ground import Ground
from biped.engines.spans import push_spans
from biped.measure.general.trajectory import GeneralTrajectory, columns_of, width_of
from biped.robot.general.build import compiled, frame, limits_of
from biped.robot.general.recognise import robot_of
from biped.robot.run import Run
from biped.scenario.pushing import pieces

if TYPE_CHECKING:
    from biped.engines.general.walk import Plant

Watch = Callable[[mujoco.MjModel, mujoco.MjData, np.ndarray], None]
"""Called after every tick with the model, its data, and the pushes that act, (bodies, 3) [N]."""

_SPLIT = ("Euler", "implicit", "implicitfast")
"""Integrators whose step has two halves, between which a law can be asked without computing anything twice."""
_STILL = 0.2
"""[m/s] below which a fall has no direction."""


def simulate(run: Run, watch: Watch | None = None) -> GeneralTrajectory:
    """Simulates a run.

    Args:
        run: A concrete run.
        watch: Who looks on.

    Returns:
        What it left behind.

    Raises:
        InputError: The law cannot be used, or misbehaves at the first tick.
    """
    return _Simulation(run, watch).drive()


def loop_of(run: Run) -> str:
    """How a run's ticks are looped over: compiled, or in Python."""
    return "in Python" if _Simulation(run, None).plant is None else "compiled"


class _Simulation:
    """One run."""

    def __init__(self, run: Run, watch: Watch | None):
        s = run.scenario
        assert s.robot is not None
        self.s, self.watch = s, watch
        self.robot = robot_of(run.model, s.robot)
        make, name, file = maker_of(run)
        self.command = command_of(make, s, name)
        self.model = compiled(run.model, s, self.command)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = run.q, run.v
        self.tick = 1.0 / s.simulation.control_rate
        self.substeps = round(self.tick / s.simulation.timestep)
        self.count = round(s.duration * s.simulation.control_rate)
        self.limits = limits_of(self.robot, s)
        size = self.model.nv if self.command == "generalized" else len(self.robot.drives)
        setup = Setup(s, run.gains, self.robot, copy.copy(self.model), run.model, self.tick, self.limits.copy(),
                      run.q.copy(), run.v.copy())  # fmt: skip
        self.law = Asked(make, name, file, setup, size, self.count)
        self.sensed = Sensed(self.model, self.data, self.robot)
        self.ground, self.account = Ground(self.model, self.data, self.robot), Account(self.model, self.data)
        self.wanted = np.zeros(size)
        self.follow = 1.0 if s.actuation.lag == 0.0 else 1.0 - math.exp(-self.tick / s.actuation.lag)
        self.split = s.simulation.integrator in _SPLIT
        self.parts = {
            name: slice(first, first + math.prod(shape)) for name, (first, shape) in columns_of(self.robot).items()
        }
        self.log = np.zeros((self.count, width_of(self.robot)))
        self.up = -np.array(self.model.opt.gravity) / np.linalg.norm(self.model.opt.gravity)
        self.least = 0.0
        legs = [foot.joints for foot in self.robot.feet]
        self.anchors = [joints[min(i, len(joints) - 1)] if joints else 0 for joints in legs for i in range(3)]
        self.without = [(3 * foot + i, foot) for foot, joints in enumerate(legs) for i in range(len(joints), 3)]
        self.feet = self.robot.of_foot
        self.plant = self._compiled() if watch is None and self.follow == 1.0 else None

    def _compiled(self) -> Plant | None:
        """What the compiled loop is handed, where the law has one."""
        if self.s.law != "spatial" or not self.split:
            return None
        from biped.engines.general.compiled import plant_of

        mujoco.mj_kinematics(self.model, self.data)
        self.least = self.s.fall.height * float(self.data.xipos[self.robot.base_number, 2])
        return plant_of(self.law.law, self.model, self.data, self.robot, self.substeps, self.least, self.s.fall.tilt,
                        columns_of(self.robot), self.anchors)  # fmt: skip

    def _span(self, first: int, last: int) -> tuple[int, tuple[str, str] | None]:
        """Ticks first … last - 1 in the compiled loop: how many rows there are now, and how it ended if it did."""
        from biped.engines.general.walk import FALLEN, NOT_FINITE, walk
        from biped.engines.native import without_clock

        with without_clock():
            status, k = walk(self.law.law.record, self.plant, self.log, self.law.signals.values, first, last)
        if status == NOT_FINITE:
            return k + 1, self._diverged(k)
        self.sensed.begin(k * self.tick)
        return (k + 1, self._fallen(k, k * self.tick)) if status == FALLEN else (last, None)

    def _turned(self, force: tuple[float, ...]) -> np.ndarray:
        """(3,) [N] of a push in the ground's frame."""
        ground = self.s.ground
        return frame(ground.slope, ground.side_slope) @ np.array(_in_space(force))

    def drive(self) -> GeneralTrajectory:
        done, end, cause, trace = 0, "completed", "", ""
        for first, last, forces in push_spans(self.s, self.robot.bodies, self._turned, self.count, self.tick):
            self.data.xfrc_applied[1:, :3] = forces
            self.account.push()
            if self.plant is not None:
                from biped.engines.general.compiled import on_base

                if on_base(forces, self.model, self.robot):
                    done, ended = self._span(first, last)
                    if ended is not None:
                        end, cause = ended
                        break
                    continue
            for k in range(first, last):
                done = k + 1
                try:
                    fallen = self._tick(k)
                except Raised as error:
                    if k == 0:
                        raise
                    end, cause, trace = "raised", error.cause, error.traceback
                    break
                if fallen is not None:
                    end, cause = fallen
                    break
                if self.watch is not None:
                    self.watch(self.model, self.data, forces)
            if end != "completed":
                break
        return self._trajectory(done, end, cause, trace)

    def _tick(self, k: int) -> tuple[str, str] | None:
        """One tick: senses, logs, judges, asks the law and steps; how it ended if it did."""
        model, data, time = self.model, self.data, k * self.tick
        if self.split:
            mujoco.mj_step1(model, data)
        else:
            mujoco.mj_forward(model, data)
        line = self.log[k]
        if not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()):
            return self._diverged(k)
        self.sensed.begin(time)
        points = self.sensed.points
        self.sensed.touching[:] = self.ground.touching(points)
        self._note(line, time, points)
        if (fallen := self._fallen(k, time)) is not None:
            return fallen
        wanted = self.law.ask(k, self.sensed)
        if self.command == "torque":
            wanted = np.clip(wanted, -self.limits, self.limits)
        self.wanted += self.follow * (wanted - self.wanted)
        (data.qfrc_applied if self.command == "generalized" else data.ctrl)[:] = self.wanted
        self._steps(line, points)
        return None

    def _diverged(self, k: int) -> tuple[str, str]:
        """That a coordinate is not finite at tick k."""
        worst = self.robot.v_names[int(np.argmax(np.abs(self.log[max(k - 1, 0)][self.parts["v"]])))]
        time = (k - 1) * self.tick
        return "diverged", f"a coordinate stopped being finite after {time:.3f} s (largest: {worst})"

    def _steps(self, line: np.ndarray, points: np.ndarray) -> None:
        """The physics of a tick; forces are means over its steps."""
        model, data, account = self.model, self.data, self.account
        drives = len(self.robot.drives)
        force, total, torque = np.zeros_like(points), np.zeros(3), np.zeros(drives)
        account.begin()
        for step in range(self.substeps):
            if step:
                mujoco.mj_step1(model, data) if self.split else mujoco.mj_forward(model, data)
                self.ground.touching(points)
            account.before()
            if self.split:
                mujoco.mj_step2(model, data)
            else:
                mujoco.mj_step(model, data)
                self.ground.touching(points)  # the contacts are those of the last of its stages
            account.after()
            found = self.ground.forces(len(points))
            force += found.point
            total += found.total
            if self.command != "generalized":
                torque += data.actuator_force
        share = 1.0 / self.substeps
        self.sensed.ground_force[:] = force * share
        line[self.parts["force"]] = (force * share).ravel()
        line[self.parts["ground_force"]] = total * share
        line[self.parts["u"]] = torque * share
        line[self.parts["work"]], line[self.parts["given"]] = account.work, account.given

    def _note(self, line: np.ndarray, time: float, points: np.ndarray) -> None:
        """Logs the state at a tick."""
        data, base = self.data, self.robot.base_number
        for name, values in (
            ("time", time), ("q", data.qpos), ("v", data.qvel), ("point", points.ravel()),
            ("contact", self.sensed.touching), ("com", self.sensed.com), ("com_velocity", self.sensed.com_velocity),
            ("base", np.concatenate([data.xpos[base], data.xquat[base]])), ("energy", self._energy()),
            ("figure", self._figure(points)),
        ):  # fmt: skip
            line[self.parts[name]] = values

    def _figure(self, points: np.ndarray) -> np.ndarray:
        """(21,) [m] joints of the legs and the trunk's end, for a stick figure."""
        data, robot = self.data, self.robot
        out = np.empty((7, 3))
        out[:6] = data.xanchor[self.anchors]
        for row, foot in self.without:  # a foot on no ankle
            out[row] = points[self.feet == foot].mean(axis=0)
        out[6] = data.xpos[robot.base_number] + data.xmat[robot.base_number].reshape(3, 3) @ robot.top
        return out.ravel()

    def _energy(self) -> float:
        """[J] potential and kinetic; the rotors' included."""
        mujoco.mj_energyPos(self.model, self.data)
        mujoco.mj_energyVel(self.model, self.data)
        return float(self.data.energy.sum())

    def _fallen(self, k: int, time: float) -> tuple[str, str] | None:
        """Whether the base is too low or leans too far."""
        data, number, fall = self.data, self.robot.base_number, self.s.fall
        height = float(data.xipos[number, 2])
        if k == 0:
            self.least = fall.height * height
        axis = data.xmat[number].reshape(3, 3) @ self.robot.upright
        lean = math.degrees(math.acos(float(np.clip(axis @ self.up, -1.0, 1.0))))
        if height >= self.least and lean <= fall.tilt:
            return None
        # A base held upright over toppling legs falls the way it moves; otherwise the way it leans.
        forward, left = (self.sensed.com_velocity if lean <= fall.tilt else axis)[:2]
        if max(abs(forward), abs(left)) < _STILL:
            return "fell", f"collapsed at {time:.3f} s"
        if abs(left) > abs(forward):
            return "fell", f"fell to the {'left' if left > 0.0 else 'right'} at {time:.3f} s"
        return "fell", f"fell {'forward' if forward > 0.0 else 'backward'} at {time:.3f} s"

    def _trajectory(self, done: int, end: str, cause: str, trace: str) -> GeneralTrajectory:
        s, data = self.s, self.data
        counts = data.warning.number
        warnings = {
            mujoco.mjtWarning(i).name.removeprefix("mjWARN_").lower(): int(counts[i]) for i in np.flatnonzero(counts)
        }
        if warnings and end != "diverged":
            # What falls because the numbers exploded has not fallen.
            said = f"MuJoCo warned of {', '.join(warnings)} before {self.log[done - 1, 0]:.3f} s"
            end, cause = "diverged", f"{said}; {cause}" if cause else said
        log = self.log[:done]
        if self.law.signals.names:
            log = np.hstack([log, self.law.signals.values[:done]])
        return GeneralTrajectory(
            log=log,
            tick=self.tick,
            slope=s.ground.slope,
            side_slope=s.ground.side_slope,
            gravity=tuple(self.model.opt.gravity.tolist()),
            generalized=self.command == "generalized",
            torque_limit=tuple(self.limits.tolist()),
            pushes=tuple((p.start, p.end, *_in_space(p.force), p.body) for p in pieces(s)),
            end=end,
            cause=cause,
            warnings=warnings,
            robot=self.robot,
            sampled=not self.split,
            signal_names=self.law.signals.names,
            traceback=trace,
        )


def _in_space(force: tuple[float, ...]) -> tuple[float, float, float]:
    """(3,) [N] forward, to the left and up, of a push in the plane or in space."""
    return (force[0], 0.0, force[1]) if len(force) == 2 else (force[0], force[1], force[2])
