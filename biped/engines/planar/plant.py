"""Seven links in a plane as a plant: the thesis's law and the physics in one compiled loop, other laws in Python."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from biped.base.jit import bound, inner_kernel, kernel
from biped.control.blending import Changes, fraction
from biped.control.planar.controller import ThesisLaw, Tick, law_of
from biped.control.planar.estimator import infer
from biped.control.planar.loop import Control, actuate, decide, with_unmodelled, within_line, without_unmodelled
from biped.control.planar.prediction import believe, prediction_of, predicts
from biped.engines.loop import GOING, LOW, NOT_FINITE, TILTED, Ending, fall_words, in_python
from biped.measure.seven_links import PlanarTrajectory
from biped.measure.trajectory import Trajectory
from biped.measure.verdict import unsolved
from biped.robot.columns import Q_D, WIDTH, Q, U, V
from biped.robot.ground import GROUND, height_below, set_ground
from biped.robot.planar.topology import LEGS, NQ, PITCH, TORSO, X, Z
from biped.robot.planar.tree import Tree
from biped.robot.robot import with_tree
from biped.robot.run import Run
from biped.robot.unmodelled import unmodelled_of
from biped.scenario.keys import Sensors as SensorKeys
from biped.scenario.pushing import pieces

if TYPE_CHECKING:
    from biped.control.planar.senses import PlanarSensors, Senses

FALL = np.dtype(
    [("least", "f8"), ("tilt", "f8"), ("slope", "f8"), ("com", "f8", 2), ("ground", GROUND)],
    align=True,
)
"""Bounds of a fall: [m] height of the torso's centre of mass, [rad] of its lean from the vertical; the slope [rad], and
where [m] in the torso's frame its centre of mass is."""


def fall_of(run: Run, tree: Tree) -> np.ndarray:
    """The bounds (1,) of a fall of a run.

    Args:
        run: The run.
        tree: Lengths and masses of the biped that walks.
    """
    s, out = run.scenario, np.zeros(1, FALL)
    bounds, profile, (along, up) = out[0], run.profile, tree.com[TORSO]
    set_ground(bounds["ground"], profile)
    bounds["tilt"], bounds["slope"], bounds["com"] = np.radians(s.fall.tilt), np.radians(s.ground.slope), (along, up)
    cos, sin = math.cos(run.q[PITCH]), math.sin(run.q[PITCH])
    height = run.q[Z] + sin * along + cos * up - float(profile.height(run.q[X] + cos * along - sin * up))
    bounds["least"] = s.fall.height * height
    return out


@inner_kernel
def _height(bounds, q):
    """Height [m] of the torso's centre of mass above the ground, normal to it."""
    x, z = q[X], q[Z]
    along, up = bounds["com"][0], bounds["com"][1]
    if along != 0.0 or up != 0.0:
        c, s = math.cos(q[PITCH]), math.sin(q[PITCH])
        x, z = x + c * along - s * up, z + s * along + c * up
    return z - height_below(bounds["ground"], x)


@kernel
def judge(fall, q, v):
    """Judges the true state: GOING, LOW, TILTED or NOT_FINITE.

    Args:
        fall: (1,) `FALL`.
        q: (9,) true joint coordinates [m, rad].
        v: (9,) true joint velocities.
    """
    bounds = fall[0]
    for j in range(NQ):
        if not (math.isfinite(q[j]) and math.isfinite(v[j])):
            return NOT_FINITE
    if _height(bounds, q) < bounds["least"]:
        return LOW
    if abs(q[PITCH] + bounds["slope"]) > bounds["tilt"]:
        return TILTED
    return GOING


@inner_kernel
def tick(control, fall, q, v, applied, log, k):
    """Decides at tick k, judges the state, and moves the actuators if the run goes on.

    Args:
        control: `biped.control.planar.loop.Control`.
        fall: (1,) `FALL`.
        q: (9,) true joint coordinates [m, rad].
        v: (9,) true joint velocities.
        applied: (6,) joint torques or (9,) generalized forces that act in the coming steps, overwritten.
        log: (n, WIDTH) log, row k is written but for its ground forces.
        k: Number of the tick.

    Returns:
        GOING, LOW, TILTED or NOT_FINITE.
    """
    status = decide(control, q, v, log, k)
    if status == GOING:
        status = judge(fall, q, v)
    if status == GOING:
        actuate(control, q, v, applied, log, k)
    return status


NO_SENSORS = SensorKeys()
NO_CHANGES = Changes(np.empty(0), np.empty(0), np.zeros(LEGS, int))


Advance = Callable[[int, int], tuple[int, int]]


class Physics(NamedTuple):
    """The physics of an engine; arrays are live.

    Attributes:
        tree: Lengths and masses of the biped that walks.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.
        applied: Joint torques (6,), or with `generalized` actuation generalized forces (9,), that act.
        bodies: Names of the bodies that can be pushed.
        push: Called where pushes change with forces (len(bodies), 2) [N] along and normal to the ground.
        step: Called with (k, log) to move the physics through tick k and to log its ground forces.
        walk: Called once with (control, fall, log); what it returns is called with (first, last) for ticks first …
            last - 1 in compiled code and returns the last tick's status and the number of ticks that are logged. None:
            there is no such code.
        warnings: How often the engine has warned of what.
    """

    tree: Tree
    q: np.ndarray
    v: np.ndarray
    applied: np.ndarray
    bodies: Sequence[str]
    push: Callable[[np.ndarray], None]
    step: Callable[[int, np.ndarray], None]
    walk: Callable[[Control, np.ndarray, np.ndarray], Advance] | None
    warnings: Callable[[], dict[str, int]]


class PlanarPlant:
    """The plant of a run (`biped.engines.loop.Plant`).

    Args:
        run: The run.
        physics: What moves the biped.

    Attributes:
        advance: As of the protocol.
    """

    def __init__(self, run: Run, physics: Physics):
        s = run.scenario
        self.run, self.physics = run, physics
        self.bodies, self.push, self.warnings = physics.bodies, physics.push, physics.warnings
        self.log = np.zeros((run.ticks, WIDTH))
        sensors, self.senses = _sensors(run, physics), _senses(run, physics)
        between = sensors if self.senses is None else self.senses
        sensed = (physics.q, physics.v) if between is None else (between.q, between.v)
        predictor = (prediction_of(s, *sensed),) if predicts(s) else ()
        q, v = (sensed[0].copy(), sensed[1].copy()) if predictor else sensed
        estimator = () if self.senses is None else (self.senses.inference,)
        self.law = law = law_of(run, run.tree, q, v, self.log)
        self.generalized = s.actuation.mode == "generalized"
        wanted, logged = (law.Q_d, Q_D) if self.generalized else (law.u, U)
        changes = law.changes if isinstance(law, ThesisLaw) else NO_CHANGES
        control = Control(
            law.record, changes, q, v, *sensed, *_between(sensors), wanted, logged,
            fraction(s.actuation.lag, run.tick), run.tick, (True,) if law.record["push"]["on"][0] else (),
            _line(run), estimator, predictor, unmodelled_of(run),
        )  # fmt: skip
        fall = fall_of(run, physics.tree)
        if physics.walk is not None and isinstance(law, ThesisLaw) and not law.python:
            self.advance: Advance = physics.walk(control, fall, self.log)
        else:
            self.advance = self._in_python(control, fall, law.tick, sensors)

    def turned(self, force: tuple[float, ...]) -> np.ndarray:
        """(2,) [N] of a force forward and up, along and normal to the slope."""
        return turned(self.run.scenario.ground.slope, force)

    def _in_python(
        self, control: Control, fall: np.ndarray, decide: Tick, sensors: PlanarSensors | None
    ) -> Callable[[int, int], tuple[int, int]]:
        """The loop tick by tick in Python: for laws and engines that are not compiled."""
        physics, log, follow, period = self.physics, self.log, control.follow, self.run.tick
        q, v, applied, wanted = physics.q, physics.v, physics.applied, control.wanted
        columns = slice(control.logged, control.logged + len(applied))
        judged = bound(judge, fall, q, v)
        believed = bool(control.predictor)
        between = sensors is not None or bool(control.estimator) or believed

        def tick(k: int) -> int:
            if sensors is not None:
                sensors.measure(k)
            elif control.estimator:
                infer(control.estimator, control.record, q, v, log, k, control.sensed_q, control.sensed_v)
            if believed:
                believe(control.predictor, control.estimator, control.record, k, control.q, control.v)
            status = decide(k, k * period)
            if between:  # the log has the true coordinates
                log[k, Q : Q + NQ], log[k, V : V + NQ] = q, v
            if status == GOING:
                status = judged(fall, q, v)
            if status == GOING:
                if control.line:
                    within_line(control.line, v, wanted, log, k)
                without_unmodelled(control.unmodelled, applied)
                if follow == 1.0:
                    applied[:] = wanted
                else:
                    applied[:] += follow * (wanted - applied)
                    log[k, columns] = applied
                with_unmodelled(control.unmodelled, q, v, applied, log, k)
            return status

        step = physics.step
        return in_python(tick, lambda k: step(k, log))

    def fall(self, status: int, row: int) -> str:
        """How the torso fell at a row of the log."""
        line = self.log[row]
        way = line[V + X] if status == LOW else -np.sin(line[Q + PITCH] + np.radians(self.run.scenario.ground.slope))
        return fall_words(np.array([way, 0.0]), row * self.run.tick)

    def velocities(self, row: int) -> tuple[Sequence[str], np.ndarray]:
        """Names and values of the velocities in a row of the log."""
        return self.run.robot.q_names, self.log[row, V : V + NQ]

    def trajectory(self, rows: int, ending: Ending) -> Trajectory:
        """The trajectory of so many rows."""
        s, law, log = self.run.scenario, self.law, self.log[:rows]
        if law.signals.names:
            log = np.hstack([log, law.signals.values[:rows]])
        return PlanarTrajectory(
            log=log,
            tick=self.run.tick,
            slope=s.ground.slope,
            generalized=self.generalized,
            torque_limit=self.run.torque_limits,
            pushes=tuple((p.start, p.end, p.force[0], p.force[1], p.body) for p in pieces(s)),
            end=ending.end,
            cause=ending.cause,
            warnings=ending.warnings | unsolved(int(law.record["memory"]["given_up"][0]) + law.signals.unsolved(rows)),
            robot=with_tree(self.run.robot, self.physics.tree),
            inferred=None if self.senses is None else self.senses.noted[:rows],
            signal_names=law.signals.names,
            traceback=ending.traceback,
            ground=self.run.profile,
            changes=tuple(change.at for change in s.change),
        )


def turned(slope: float, force: tuple[float, ...]) -> np.ndarray:
    """(2,) of a force forward and up, along and normal to a slope [degrees]."""
    angle = np.radians(slope)
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) @ np.array(force)


def _line(run: Run) -> tuple[np.ndarray, ...]:
    """The torque-speed line of the run's motors, if it is to keep within it."""
    if not run.scenario.actuation.motors or (motor := run.robot.motor) is None:
        return ()
    return (np.array([motor.stall, motor.free]),)


def _senses(run: Run, physics: Physics) -> Senses | None:
    """The run's encoders, gyro, switches and estimator, or None if the controller is told its posture."""
    if run.scenario.estimator is None:
        return None
    from biped.control.planar.senses import Senses

    return Senses(run, run.tree, physics.q, physics.v, run.ticks)


def _sensors(run: Run, physics: Physics) -> PlanarSensors | None:
    """The run's sensors, or None if the controller reads the state itself."""
    if run.scenario.sensors == NO_SENSORS or run.scenario.estimator is not None:
        return None
    from biped.control.planar.senses import PlanarSensors

    return PlanarSensors(run, physics.q, physics.v, run.ticks)


def _between(sensors: PlanarSensors | None) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Noise, its deviation, past and resolution of sensors, or nothing of each."""
    if sensors is None:
        return np.empty((2, 0, NQ)), np.empty((2, NQ)), np.empty((0, 2, NQ)), 0.0
    return sensors.noise, sensors.deviation, sensors.past, sensors.resolution
