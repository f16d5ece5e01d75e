"""One tick of a thesis controller between what is measured and what is applied, for compiled loops."""

from typing import NamedTuple

import numpy as np

from biped.base.jit import inner_kernel
from biped.control.blending import Changes
from biped.control.planar.estimator import Inference, infer
from biped.control.planar.prediction import Prediction, believe
from biped.control.planar.setup import bring_up_to_date
from biped.control.planar.tick import law_tick
from biped.robot.columns import Q, U, V
from biped.robot.planar.topology import BASE, NQ, NU, PITCH
from biped.robot.unmodelled import Unmodelled, torques_at


class Control(NamedTuple):
    """A run's controller as compiled loops take it.

    Attributes:
        record: (1,) `biped.control.planar.setup.CONTROL`.
        changes: Of it, `biped.control.blending.Changes`.
        q: (9,) joint coordinates that the law reads [m, rad]: believed ones, else sensed ones.
        v: (9,) joint velocities that it reads.
        sensed_q: (9,) measured joint coordinates; the true ones where nothing is between.
        sensed_v: (9,) measured joint velocities.
        noise: (2, n, 9) added, times `deviation`, to the measurements of each tick; empty without sensors.
        deviation: (2, 9) of coordinates and velocities.
        past: (delay + 1, 2, 9) latest true coordinates and velocities.
        resolution: [rad] of measured angles; 0: exact.
        wanted: (6,) u or (9,) Q_d of the latest tick, live.
        logged: Column of the log where it stands.
        follow: Fraction of the way to the wanted that actuators go in a tick; 1: all of it.
        tick: [s].
        pushing: (True,) for ground that only pushes, otherwise () (`biped.control.planar.tick.law_tick`).
        line: ((2, 6),) torque [N m] of joints held still, rate [rad/s] of free ones, where motors limit, otherwise ().
        estimator: (`biped.control.planar.estimator.Inference`,) where q and v are inferred, otherwise ().
        predictor: (`biped.control.planar.prediction.Prediction`,) where q and v are believed, otherwise ().
        unmodelled: (`biped.robot.unmodelled.Unmodelled`,) where joint torques are added, otherwise ().
    """

    record: np.ndarray
    changes: Changes
    q: np.ndarray
    v: np.ndarray
    sensed_q: np.ndarray
    sensed_v: np.ndarray
    noise: np.ndarray
    deviation: np.ndarray
    past: np.ndarray
    resolution: float
    wanted: np.ndarray
    logged: int
    follow: float
    tick: float
    pushing: tuple[bool, ...]
    line: tuple[np.ndarray, ...]
    estimator: tuple[Inference, ...]
    predictor: tuple[Prediction, ...]
    unmodelled: tuple[Unmodelled, ...]


@inner_kernel
def measure(k, true_q, true_v, noise, deviation, past, resolution, q, v):
    """Writes what the sensors make of the state at tick k: late, noisy, rounded.

    Args:
        k: Number of the tick.
        true_q: (9,) joint coordinates [m, rad].
        true_v: (9,) joint velocities.
        noise: (2, n, 9) added, times `deviation`, to coordinates and velocities.
        deviation: (2, 9) of both.
        past: (delay + 1, 2, 9) latest true coordinates and velocities; at the start all are those of the start.
        resolution: [rad] of the angles; 0: exact.
        q: (9,) measured coordinates, overwritten.
        v: (9,) measured velocities, overwritten.
    """
    size = past.shape[0]
    for i in range(size if k == 0 else 1):
        at = (k + i) % size
        for j in range(NQ):
            past[at, 0, j] = true_q[j]
            past[at, 1, j] = true_v[j]
    oldest = (k + 1) % size
    for j in range(NQ):
        q[j] = past[oldest, 0, j] + noise[0, k, j] * deviation[0, j]
        v[j] = past[oldest, 1, j] + noise[1, k, j] * deviation[1, j]
        if resolution > 0.0 and j >= PITCH:
            q[j] = np.rint(q[j] / resolution) * resolution


@inner_kernel
def within_line(line, v, u, log, k):
    """Brings torques u (6,) within the motors' torque-speed line, where there is one (`Control.line`), and logs them.

    At full voltage a joint's torque is stall (1 - rate/free) one way and -stall (1 + rate/free) the other.
    """
    if len(line) == 0:
        return
    for j in range(NU):
        stall, slowed = line[0][0, j], v[BASE + j] / line[0][1, j]
        u[j] = min(max(u[j], -stall * (1.0 + slowed)), stall * (1.0 - slowed))
        log[k, U + j] = u[j]


@inner_kernel
def decide(control, q, v, log, k):
    """Measures and has the law decide at tick k; the log has the true coordinates, whatever the law measured.

    Args:
        control: `Control`.
        q: (9,) true joint coordinates.
        v: (9,) true joint velocities.
        log: (n, WIDTH) log, row k is written but for its ground forces.
        k: Number of the tick.

    Returns:
        A status of `biped.control.planar.tick`.
    """
    measured = control.noise.size > 0
    if measured:
        measure(
            k, q, v, control.noise, control.deviation, control.past, control.resolution,
            control.sensed_q, control.sensed_v,
        )  # fmt: skip
    infer(control.estimator, control.record, q, v, log, k, control.sensed_q, control.sensed_v)
    believe(control.predictor, control.estimator, control.record, k, control.q, control.v)
    bring_up_to_date(control.record, control.changes, k)
    status = law_tick(control.record, control.q, control.v, log, k, k * control.tick, control.pushing)
    if measured or len(control.estimator) > 0 or len(control.predictor) > 0:
        for j in range(NQ):
            log[k, Q + j] = q[j]
            log[k, V + j] = v[j]
    return status


@inner_kernel
def without_unmodelled(unmodelled, applied):
    """Takes what nobody modelled back from the joint torques (6,): what is left is what actuators do."""
    if len(unmodelled) == 0:
        return
    for j in range(NU):
        applied[j] -= unmodelled[0].added[j]


@inner_kernel
def with_unmodelled(unmodelled, q, v, applied, log, k):
    """Adds what nobody modelled to the joint torques (6,), within their limits, and logs the sum."""
    if len(unmodelled) == 0:
        return
    made = unmodelled[0]
    torques_at(made, q[BASE:], v[BASE:])
    for j in range(NU):
        own, limit = applied[j], made.limits[j]
        applied[j] = min(max(own + made.added[j], -limit), limit)
        made.added[j] = applied[j] - own
        log[k, U + j] = applied[j]


@inner_kernel
def actuate(control, q, v, applied, log, k):
    """Moves the actuators of tick k towards what the law wants.

    Args:
        control: `Control`.
        q: (9,) true joint coordinates [m, rad].
        v: (9,) true joint velocities.
        applied: (6,) joint torques or (9,) generalized forces that act in the coming steps, overwritten.
        log: (n, WIDTH) log; what acts is written into row k.
        k: Number of the tick.
    """
    within_line(control.line, v, control.wanted, log, k)
    without_unmodelled(control.unmodelled, applied)
    follow, logged = control.follow, control.logged
    for j in range(applied.size):
        if follow == 1.0:
            applied[j] = control.wanted[j]
        else:
            applied[j] += follow * (control.wanted[j] - applied[j])
            log[k, logged + j] = applied[j]
    with_unmodelled(control.unmodelled, q, v, applied, log, k)
