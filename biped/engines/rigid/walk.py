"""Controller and rigid biped in one compiled loop: no Python between two ticks."""

from biped.base.jit import kernel, long_kernel
from biped.engines.planar.tick import tick
from biped.engines.rigid.events import advance
from biped.measure.columns import FORCE, STOP
from biped.robot.planar.topology import N_POINTS, N_STOPS, STOP_ROW


@kernel
def log_impulses(record, log, k, tick):
    """Writes the mean forces of a tick [s] into row k of the log.

    Rows of the record come normal first; the log wants (forward, normal). A stop's torque bends the knee: negative.
    """
    impulse, line = record[0]["ledger"]["impulse"], log[k]
    for i in range(N_POINTS):
        line[FORCE + 2 * i] = impulse[2 * i + 1] / tick
        line[FORCE + 2 * i + 1] = impulse[2 * i] / tick
    for leg in range(N_STOPS):
        line[STOP + leg] = impulse[STOP_ROW + leg] / -tick


@kernel
def log_work(record, account, k):
    """Writes the work less the losses of impacts [J] up to the end of tick k, where an account is kept."""
    if account.size > 0:
        account[k] = record[0]["ledger"]["work"] - record[0]["ledger"]["loss"]


@long_kernel
def walk_rigid(record, control, fall, q, v, applied, step, steps, log, account, first, last):
    """Ticks first … last - 1 of a run.

    Args:
        record: (1,) `biped.engines.rigid.record.RIGID`.
        control: `biped.control.planar.loop.Control`.
        fall: (1,) `biped.engines.planar.tick.FALL`.
        q: (9,) joint coordinates [m, rad], overwritten.
        v: (9,) joint velocities, overwritten.
        applied: (6,) or (9,) forces that act, part of the record.
        step: [s] of integration.
        steps: Number of steps in a tick.
        log: (n, WIDTH) log.
        account: (n,) [J] as of `log_work`, or (0,).
        first: First tick.
        last: One past the last.

    Returns:
        The status of the last tick and the number of ticks logged.
    """
    for k in range(first, last):
        status = tick(control, fall, q, v, applied, log, k)
        if status != 0:
            return status, k + 1
        advance(record, q, v, step, steps)
        log_impulses(record, log, k, control.tick)
        log_work(record, account, k)
    return 0, last
