"""A run of a robot of any kind in MuJoCo: sense, ask the law, step; until it ends, falls or is not finite."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from msgspec import structs

from biped.control.general.law import Asked, Setup, command_of, maker_of
from biped.control.general.sensed import Sensed
from biped.control.law import Raised
from biped.control.smoothing import fraction
from biped.engines.general.account import Account
from biped.engines.general.ground import Ground
from biped.engines.general.notes import Notes
from biped.engines.general.uneven import Uneven, own
from biped.engines.general.upright import Upright
from biped.engines.spans import push_spans
from biped.measure.general.trajectory import GeneralTrajectory, columns_of, width_of
from biped.robot.build import compiled, frame
from biped.robot.ground import levelled
from biped.robot.run import Run
from biped.scenario.laws import SPATIAL
from biped.scenario.pushing import pieces
from biped.scenario.senses import Sensors
from biped.scenario.truth import Truth

if TYPE_CHECKING:
    from biped.engines.general.walk import Plant

Watch = Callable[[mujoco.MjModel, mujoco.MjData, np.ndarray], None]
"""Called after every tick with the model, its data, and the pushes that act, (bodies, 3) [N]."""

_SPLIT = ("Euler", "implicit", "implicitfast")
"""Integrators whose step has two halves, between which a law can be asked without computing anything twice."""


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
        self.run, self.s, self.watch = run, s, watch
        self.robot = run.robot
        make, name, file = maker_of(run)
        self.command = command_of(make, s, name)
        self.model = compiled(run.model, s, self.command)
        self.profile = run.profile
        if not self.profile.level:
            self.model = own(self.model)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = run.q, run.v
        self.tick = 1.0 / s.simulation.control_rate
        self.substeps = round(self.tick / s.simulation.timestep)
        self.count = round(s.duration * s.simulation.control_rate)
        self.limits = np.array(run.torque_limits)
        size = self.model.nv if self.command == "generalized" else len(self.robot.drives)
        # Of how the robot differs from its file a law knows nothing, nor what lies ahead on its way.
        told = structs.replace(s, truth=Truth(), ground=levelled(s.ground))
        known = self.model if s == told else compiled(run.model, told, self.command)
        setup = Setup(s, run.gains, self.robot, copy.copy(known), run.model, self.tick, self.limits.copy(),
                      run.q.copy(), run.v.copy())  # fmt: skip
        self.law = Asked(make, name, file, setup, size, self.count)
        self.true = self.sensed = Sensed(self.model, self.data, self.robot, self.profile)
        self.measured = None
        if known is not self.model or s.sensors != Sensors():
            from biped.control.general.measured import Measured

            self.measured = Measured(run, copy.copy(known), self.robot, self.tick)
            self.sensed = Sensed(self.measured.model, self.measured.data, self.robot, self.profile)
        self.uneven = None if self.profile.level else Uneven(self.model, self.data, self.profile)
        planes = None if self.uneven is None else self.uneven.planes
        self.ground, self.account = Ground(self.model, self.data, self.robot, planes), Account(self.model, self.data)
        self.wanted = np.zeros(size)
        self.follow = fraction(s.actuation.lag, self.tick)
        self.split = s.simulation.integrator in _SPLIT
        self.parts = {
            name: slice(first, first + math.prod(shape)) for name, (first, shape) in columns_of(self.robot).items()
        }
        self.log = np.zeros((self.count, width_of(self.robot)))
        self.notes = Notes(self.model, self.data, self.robot, self.parts)
        self.upright = Upright(self.model, self.data, self.robot, s.fall, self.profile)
        self.plant = self._compiled() if watch is None and self.follow == 1.0 else None

    def _compiled(self) -> Plant | None:
        """What the compiled loop is handed, where the law has one."""
        if self.s.law != SPATIAL or not self.split or self.measured is not None:
            return None
        from biped.engines.general.compiled import plant_of

        return plant_of(self.law.law, self.model, self.data, self.robot, self.substeps, self.upright.least,
                        self.s.fall.tilt, columns_of(self.robot), self.notes.anchors)  # fmt: skip

    def _span(self, first: int, last: int) -> tuple[int, tuple[str, str] | None]:
        """Ticks first … last - 1 in the compiled loop: how many rows there are now, and how it ended if it did."""
        from biped.engines.general.walk import FALLEN, NOT_FINITE, walk
        from biped.engines.native import without_clock

        with without_clock():
            law, signals = self.law.law, self.law.signals.values
            status, k = walk(law.record, law.changes, self.plant, self.log, signals, first, last)
        if status == NOT_FINITE:
            return k + 1, self._diverged(k)
        self.sensed.begin(k * self.tick)
        if status != FALLEN:
            return last, None
        return k + 1, self.upright.fallen(self.sensed.com_velocity, k * self.tick)

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
        data, time = self.data, k * self.tick
        self._first_half()
        line = self.log[k]
        if not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()):
            return self._diverged(k)
        self.true.begin(time)
        points = self.true.points
        self.true.touching[:] = self.ground.touching(points)
        self.notes.write(line, self.true, time)
        if (fallen := self.upright.fallen(self.true.com_velocity, time)) is not None:
            return fallen
        if self.measured is not None:
            self.measured.measure(data.qpos, data.qvel)
            self.sensed.begin(time)
            self.sensed.touching[:] = self.true.touching
        wanted = self.law.ask(k, self.sensed)
        if self.command == "torque":
            wanted = np.clip(wanted, -self.limits, self.limits)
        self.wanted += self.follow * (wanted - self.wanted)
        (data.qfrc_applied if self.command == "generalized" else data.ctrl)[:] = self.wanted
        self._steps(line, points)
        return None

    def _first_half(self) -> None:
        """All of a step that comes before forces are asked for."""
        if self.uneven is not None:
            self.uneven.lay()
        if self.split:
            mujoco.mj_step1(self.model, self.data)
        else:
            mujoco.mj_forward(self.model, self.data)

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
                self._first_half()
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
            robot=self.run.true_robot,
            ground=self.profile,
            changes=tuple(change.at for change in s.change),
            sampled=not self.split,
            signal_names=self.law.signals.names,
            traceback=trace,
        )


def _in_space(force: tuple[float, ...]) -> tuple[float, float, float]:
    """(3,) [N] forward, to the left and up, of a push in the plane or in space."""
    return (force[0], 0.0, force[1]) if len(force) == 2 else (force[0], force[1], force[2])
