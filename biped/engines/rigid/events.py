"""Control ticks of rigid motion: Runge-Kutta steps between impacts and releases, which are located in time.

The scheme is the classical fourth-order one with chapter II's corrections: in every stage by `motion.evaluate`, and
once per step, with the values at its start, q -= WΦ and v -= WΦ̇. A step that would carry a point through the ground, a
knee through its stop, or hold a constraint that pulls, is cut where that begins.
"""

from biped.base.jit import entry_kernel, kernel, long_kernel
from biped.engines.planar.plant import tick
from biped.engines.rigid.gauss import add_impulse
from biped.engines.rigid.locate import attempt, beyond_event, keep_stage, locate
from biped.engines.rigid.motion import gaps, impact, land, place
from biped.engines.rigid.release import TOUCH, come_to_rest, release
from biped.robot.columns import FORCE, STOP
from biped.robot.planar.topology import N_CONSTRAINTS, N_POINTS, N_ROWS, N_STOPS, NQ, STOP_ROW

CUTS = 8
"""Events per step. Feet that rock from heel to toe and back have infinitely many in a finite time: after this many,
whatever touches is held until the step ends."""
NEAR = 1e-6
"""[m, rad] of gap below which an approaching point or knee is then taken to touch."""


@kernel
def advance(record, q, v, step, steps):
    """Moves (q, v) through one control tick with the forces in the record.

    Args:
        record: (1,) `biped.engines.home.RIGID`; `Q` and `push` hold for the tick; `impulse` is set to what
            ground and stops gave in it.
        q: (9,) joint coordinates [m, rad], overwritten.
        v: (9,) joint velocities, overwritten.
        step: [s] of integration.
        steps: Number of steps in the tick.
    """
    w = record[0]
    state, ledger, contact = w["state"], w["ledger"], w["contact"]
    q0, v0 = state["q0"], state["v0"]
    for j in range(NQ):
        q0[j], v0[j] = q[j], v[j]
    for row in range(N_ROWS):
        ledger["impulse"][row] = 0.0
    for _ in range(steps):
        for i in range(N_CONSTRAINTS):
            contact["held"][i] = 0
        come_to_rest(w, q0, v0)
        release(w, q0, v0)
        state["known"] = 0
        keep_stage(w, 0)
        left, cuts = step, 0
        while left > 0.0:
            taken = left
            attempt(w, left)
            event = cuts < CUTS + N_CONSTRAINTS and beyond_event(w)
            if event:
                taken = locate(w, left)
            _accept(w, taken)
            left = left - taken if left - taken > 1e-9 * step else 0.0
            if not event:
                state["known"] = 1  # the step's last evaluation is the next one's first, but for the forces of its tick
                continue
            cuts += 1
            if _arrive(w, q0, cuts >= CUTS):
                impact(w, q0, v0)
            if cuts < CUTS:
                for i in range(N_CONSTRAINTS):
                    contact["held"][i] = 0
            release(w, q0, v0)
            keep_stage(w, 0)
        if cuts >= CUTS:
            ledger["capped"] += 1
    for j in range(NQ):
        q[j], v[j] = q0[j], v0[j]


@kernel
def _accept(w, h):
    """The tentative step becomes real: its impulses and work are booked."""
    stages, ledger, state = w["stages"], w["ledger"], w["state"]
    for row in range(N_ROWS):
        lam = stages["lam"][:, row]
        add_impulse(w, row, h / 6.0 * (lam[0] + 2.0 * (lam[1] + lam[2]) + lam[3]))
    power = stages["power"]
    ledger["work"] += h / 6.0 * (power[0] + 2.0 * (power[1] + power[2]) + power[3])
    for j in range(NQ):
        state["q0"][j], state["v0"][j] = state["q1"][j], state["v1"][j]


@kernel
def _arrive(w, q, last):
    """Activates what has just closed its gap; returns whether anything has.

    What has only hopped comes to rest, by an impact that throws nothing else up: it is bilateral for all. So is
    everything, and until the step ends, once there have been too many events.
    """
    contact, system, bracket = w["contact"], w["system"], w["bracket"]
    found, resting = False, False
    for i in range(N_CONSTRAINTS):
        if not contact["active"][i]:
            closing = system["gap_rate"][i] < 0.0 and system["gap"][i] < (NEAR if last else TOUCH)
            if closing or (bracket["resting"][i] and system["gap"][i] < TOUCH):
                land(w, i, q)
                found = True
                resting = resting or bracket["resting"][i] == 1
    for i in range(N_CONSTRAINTS):
        if (last or resting) and contact["active"][i]:
            contact["held"][i] = 1
    return found


@entry_kernel
def touch_down(record, q, v):
    """Makes the constraints that touch at the start of a run active, with the impact of their velocities."""
    w = record[0]
    system = w["system"]
    place(w, q, v)
    gaps(w, q, v)
    moving = False
    for i in range(N_CONSTRAINTS):
        if system["gap"][i] < TOUCH and system["gap_rate"][i] < TOUCH:
            land(w, i, q)
            moving = moving or system["gap_rate"][i] < 0.0
    for j in range(NQ):
        moving = moving or v[j] != 0.0
    if moving:
        impact(w, q, v)


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
        record: (1,) `biped.engines.home.RIGID`.
        control: `biped.control.planar.loop.Control`.
        fall: (1,) `biped.engines.planar.plant.FALL`.
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
