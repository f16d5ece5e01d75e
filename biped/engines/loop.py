"""What both engines do the same way: tick the law and the physics in turn, push, and say how the run ended."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from biped.control.controller import ThesisLaw, law_of
from biped.control.estimator import Inference, infer, judged
from biped.control.law import Law, Raised
from biped.control.loop import Control, within_line
from biped.control.smoothing import fraction
from biped.control.tick import GOING, LOW, TILTED
from biped.engines.spans import push_spans
from biped.measure.columns import Q_D, WIDTH, Q, U, V
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import NQ, PITCH, X
from biped.robot.planar.tree import Tree
from biped.robot.robot import Robot
from biped.robot.run import Run
from biped.scenario.keys import Sensors as SensorKeys
from biped.scenario.pushing import pieces

if TYPE_CHECKING:
    from biped.control.senses import Senses
    from biped.control.sensors import Sensors

NO_SENSORS = SensorKeys()
RAISED = -1
"""Status of a tick at which a law of the user's own failed."""

MOST = 10_000
"""Ticks of one call of compiled code, which an interrupt has to wait for."""

_STILL = 0.2
"""[m/s, rad] below which a fall has no direction."""


class Physics(NamedTuple):
    """What an engine lends the loop; arrays are live.

    Attributes:
        tree: Lengths and masses of the biped that walks.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.
        applied: Joint torques (6,), or with `generalized` actuation generalized forces (9,), that act.
        bodies: Names of the bodies that can be pushed.
        push: Called where pushes change with forces (len(bodies), 2) [N] along and normal to the ground.
        step: Called with (k, log) to move the physics through tick k and to log its ground forces.
        walk: Called with (control, log, first, last) for ticks first … last - 1 in compiled code; returns the last
            tick's status and the number of ticks that are logged. None: there is no such code.
    """

    tree: Tree
    q: np.ndarray
    v: np.ndarray
    applied: np.ndarray
    bodies: Sequence[str]
    push: Callable[[np.ndarray], None]
    step: Callable[[int, np.ndarray], None]
    walk: Callable[[Control, np.ndarray, int, int], tuple[int, int]] | None


def drive(run: Run, physics: Physics) -> Trajectory:
    """Simulates a run to its end, a fall or a number that is not finite.

    The thesis's law and the physics tick in one compiled loop between pushes, where the engine has one; a user's law
    ticks in Python.

    Args:
        run: A concrete run.
        physics: What moves the biped.

    Returns:
        What the run left behind.

    Raises:
        InputError: A push names a body the model lacks, or a user's law misbehaves at the first tick.
    """
    s = run.scenario
    tick = 1.0 / s.simulation.control_rate
    count = round(s.duration * s.simulation.control_rate)
    log = np.zeros((count, WIDTH))
    sensors, senses = _sensors(run, physics, count), _senses(run, physics, count)
    between = sensors if senses is None else senses
    q, v = (physics.q, physics.v) if between is None else (between.q, between.v)
    estimator = () if senses is None else (senses.inference,)
    law = law_of(run, run.tree, q, v, log)
    generalized = s.actuation.mode == "generalized"
    wanted, logged = (law.Q_d, Q_D) if generalized else (law.u, U)
    follow = fraction(s.actuation.lag, tick)
    line = _line(run)
    if physics.walk is not None and isinstance(law, ThesisLaw) and not law.python:
        pushing = (True,) if law.c["push"]["on"] else ()
        control = Control(law.record, law.changes, q, v, *_between(sensors), wanted, logged, follow, tick, pushing,
                          line, estimator)  # fmt: skip
        walk = partial(physics.walk, control, log)
    else:
        walk = _in_python(physics, law, sensors, (estimator, q, v), line, wanted, logged, follow, tick, log)
    status, done, raised = GOING, 0, None
    for first, last, forces in push_spans(s, physics.bodies, partial(turned, s.ground.slope), count, tick):
        physics.push(forces)
        for start in range(first, last, MOST):
            try:
                status, done = walk(start, min(last, start + MOST))
            except Raised as error:
                if error.tick == 0:
                    raise
                status, done, raised = RAISED, error.tick, error
            if status != GOING:
                break
        if status != GOING:
            break
    end, cause = _ending(status, log[:done], run.robot) if raised is None else ("raised", raised.cause)
    log = log[:done]
    if law.signals.names:
        log = np.hstack([log, law.signals.values[:done]])
    return Trajectory(
        log=log,
        tick=tick,
        tree=physics.tree,
        slope=s.ground.slope,
        generalized=generalized,
        torque_limit=run.torque_limits,
        pushes=tuple((p.start, p.end, p.force[0], p.force[1], p.body) for p in pieces(s)),
        end=end,
        cause=cause,
        warnings={},
        robot=run.robot,
        inferred=None if senses is None else senses.noted[:done],
        signal_names=law.signals.names,
        traceback="" if raised is None else raised.traceback,
        ground=run.profile,
        changes=tuple(change.at for change in s.change),
    )


def _line(run: Run) -> tuple[np.ndarray, ...]:
    """The torque-speed line of the run's motors, if it is to keep within it."""
    if not run.scenario.actuation.motors or (motor := run.robot.motor) is None:
        return ()
    return (np.array([motor.stall, motor.free]),)


def _senses(run: Run, physics: Physics, count: int) -> Senses | None:
    """The run's encoders, gyro, switches and estimator, or None if the controller is told its posture."""
    if run.scenario.estimator is None:
        return None
    from biped.control.senses import Senses

    return Senses(run, run.tree, physics.q, physics.v, count)


def _sensors(run: Run, physics: Physics, count: int) -> Sensors | None:
    """The run's sensors, or None if the controller reads the state itself."""
    if run.scenario.sensors == NO_SENSORS or run.scenario.estimator is not None:
        return None
    from biped.control.sensors import Sensors

    return Sensors(run, physics.q, physics.v, count)


def _between(sensors: Sensors | None) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Noise, its deviation, past and resolution of sensors, or nothing of each."""
    if sensors is None:
        return np.empty((2, 0, NQ)), np.empty((2, NQ)), np.empty((0, 2, NQ)), 0.0
    return sensors.noise, sensors.deviation, sensors.past, sensors.resolution


def _in_python(
    physics: Physics,
    law: Law,
    sensors: Sensors | None,
    inferred: tuple[tuple[Inference, ...], np.ndarray, np.ndarray],
    line: tuple[np.ndarray, ...],
    wanted: np.ndarray,
    logged: int,
    follow: float,
    tick: float,
    log: np.ndarray,
) -> Callable[[int, int], tuple[int, int]]:
    """The loop tick by tick in Python: for laws and engines that are not compiled."""
    applied, step, next_tick = physics.applied, physics.step, law.tick
    if sensors is not None:
        next_tick = partial(_measured_tick, sensors, law, physics.q, physics.v, log)
    elif inferred[0]:
        next_tick = partial(_inferred_tick, inferred, law, physics.q, physics.v, log)
    columns = slice(logged, logged + len(applied))

    def walk(first: int, last: int) -> tuple[int, int]:
        for k in range(first, last):
            status = next_tick(k, k * tick)
            if status != GOING:
                return status, k + 1
            if line:
                within_line(line, physics.v, wanted, log, k)
            if follow == 1.0:
                applied[:] = wanted
            else:
                applied[:] += follow * (wanted - applied)
                log[k, columns] = applied
            step(k, log)
        return GOING, last

    return walk


def _measured_tick(
    sensors: Sensors, law: Law, q: np.ndarray, v: np.ndarray, log: np.ndarray, k: int, time: float
) -> int:
    """A tick through sensors; the log keeps the true coordinates."""
    sensors.measure(k)
    status = law.tick(k, time)
    log[k, Q : Q + NQ] = q
    log[k, V : V + NQ] = v
    return status


def _inferred_tick(
    inferred: tuple[tuple[Inference, ...], np.ndarray, np.ndarray],
    law: Law, q: np.ndarray, v: np.ndarray, log: np.ndarray, k: int, time: float,
) -> int:  # fmt: skip
    """A tick of a law that is told what the robot infers; the log keeps the true coordinates."""
    estimator, out_q, out_v = inferred
    infer(estimator, law.record, q, v, log, k, out_q, out_v)
    return judged(estimator, law.record, q, v, log, k, law.tick(k, time))


def turned(slope: float, force: tuple[float, ...]) -> np.ndarray:
    """(2,) of a force forward and up, along and normal to a slope [degrees]."""
    angle = np.radians(slope)
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) @ np.array(force)


def _ending(status: int, log: np.ndarray, robot: Robot) -> tuple[str, str]:
    if status == GOING:
        return "completed", ""
    time = log[-1, 0] if len(log) > 1 else 0.0
    if status in (LOW, TILTED):
        # A torso held upright over toppling legs falls the way it moves; otherwise the way it leans.
        way = log[-1, V + X] if status == LOW else -log[-1, Q + PITCH]
        way = "collapsed" if abs(way) < _STILL else "fell forward" if way > 0.0 else "fell backward"
        return "fell", f"{way} at {time:.3f} s"
    before = log[-2, Q : Q + NQ] if len(log) > 1 else log[0, Q : Q + NQ]
    worst = robot.q_names[int(np.argmax(np.abs(before)))]
    return (
        "diverged",
        f"a coordinate stopped being finite after {log[max(len(log) - 2, 0), 0]:.3f} s (largest: {worst})",
    )
