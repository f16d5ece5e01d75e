"""One control tick, fused and compiled: sense, decide the leg states, Q_d, joint torques, and the row of the log.

The log row is written here because every number in it is at hand; its columns are those of `biped.measure.trajectory`.
"""

import math

from biped.base.jit import inner_kernel, kernel
from biped.control.planar.allocation import joint_torques
from biped.control.planar.bounded import EXACT, bounded_torques
from biped.control.planar.errors import redraw
from biped.control.planar.floating import floating_torques
from biped.control.planar.phase import leg_states, step_back
from biped.control.planar.pushing import pushing_torques
from biped.control.planar.sensing import believe_contacts, first_belief, sense_links, sense_links_in, sense_motion_in
from biped.control.planar.springs import desired_forces
from biped.control.smoothing import smooth
from biped.measure.columns import ACTIVE, BELIEVED, HEIGHT, PHASE, Q_D, TIME, Q, U, V
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.planar.topology import LEGS, N_CONSTRAINTS, N_POINTS, NQ, NU

GOING, NOT_FINITE = 0, 3
"""Statuses that a tick of a law returns (`biped.engines.fall` has all of them): falls are judged by the engine."""


@inner_kernel
def sense(record, q, v, first):
    """Believed contacts and leg states, from sensed links; returns GOING or NOT_FINITE."""
    c = record[0]
    for j in range(NQ):
        if not (math.isfinite(q[j]) and math.isfinite(v[j])):
            return NOT_FINITE
    if first:
        first_belief(c)
    else:
        believe_contacts(c)
    leg_states(c, q)
    if c["backstep"]["on"]:
        step_back(c, q, v)
    return GOING


@kernel
def sense_in(record, J, q, v, first):
    """As `sense`, links too, from Pinocchio's world-frame joint Jacobian J (6, 9)."""
    sense_links_in(record[0], J, q, v)
    return sense(record, q, v, first)


@inner_kernel
def log_tick(record, q, v, log, k, time):
    """Writes row k of the log, except the ground forces, which belong to the step that follows."""
    c = record[0]
    tick, memory = c["tick"], c["memory"]
    line = log[k]
    line[TIME] = time
    for j in range(NQ):
        line[Q + j] = q[j]
        line[V + j] = v[j]
        line[Q_D + j] = tick["Q_d"][j]
    for j in range(NU):
        line[U + j] = tick["u"][j]
    for j in range(N_CONSTRAINTS):
        line[ACTIVE + j] = tick["active"][j]
    for j in range(LEGS):
        line[PHASE + j] = memory["phase"][j] + 1
    for j in range(N_POINTS):
        line[BELIEVED + j] = memory["believed"][j]
        line[HEIGHT + j] = tick["height"][j]


@inner_kernel
def thesis_tick(record, q, v, log, k, time):
    """The thesis's control law for one tick; u or Q_d is left in the record.

    Args:
        record: (1,) `biped.control.planar.record.CONTROL`; an array, because numba takes microseconds to recognise a
            bare record.
        q: (9,) measured joint coordinates [m, rad].
        v: (9,) measured joint velocities [m/s, rad/s].
        log: (n, WIDTH) log, row k is written.
        k: Number of the tick.
        time: [s].

    Returns:
        GOING or NOT_FINITE.
    """
    c = record[0]
    sense_links(c, q, v)
    M = c["work"]["M"]
    if c["actuation"]["generalized"] == 0:
        mass_matrix(c["tree"], c["at"], M)
    return _decide(record, M, q, v, log, k, time, ())


@kernel
def thesis_tick_in(record, M, h, J, bias, q, v, log, k, time):
    """As `thesis_tick`, with Pinocchio's numbers.

    Args:
        record: As there.
        M: (9, 9) mass matrix, upper triangle.
        h: (9,) bias forces.
        J: (6, 9) Jacobian of the joints in the world's frame.
        bias: (4, 3) J̇v of the points along the world's axes.
        q: As there.
        v: As there.
        log: As there.
        k: As there.
        time: As there.
    """
    sense_links_in(record[0], J, q, v)
    sense_motion_in(record[0], h, bias)
    return _decide(record, M, q, v, log, k, time, ())


@inner_kernel
def _decide(record, M, q, v, log, k, time, pushing):
    status = sense(record, q, v, k == 0)
    if status == NOT_FINITE:
        return status
    c = record[0]
    desired_forces(c, q, v)
    if c["belief"]["redrawn"]:
        redraw(c["belief"])
    if len(pushing) > 0:
        pushing_torques(c, M, q, v)
        smooth(c["tick"]["u"], c["push"]["latest"], c["push"]["follow"], k == 0)
    elif c["actuation"]["generalized"] == 0:
        c["tick"]["over"] = joint_torques(c, M, q) if c["belief"]["perturbed"] else floating_torques(c, M, q)
        if c["tick"]["over"] and c["actuation"]["bounded"] == EXACT:
            bounded_torques(c, M)
    log_tick(record, q, v, log, k, time)
    return status


@inner_kernel
def law_tick(record, q, v, log, k, time, pushing):
    """`thesis_tick` or `pushing_tick`, for loops that are compiled with the one that a run asks for, and not the other.

    Args:
        record: As for `thesis_tick`.
        q: Likewise.
        v: Likewise.
        log: Likewise.
        k: Likewise.
        time: Likewise.
        pushing: () for `thesis_tick`, (True,) for `pushing_tick`: a tuple's length is part of its type, and what hangs
            on it is decided when the loop is compiled.

    Returns:
        GOING or NOT_FINITE.
    """
    if len(pushing) == 0:
        return thesis_tick(record, q, v, log, k, time)
    return pushing_tick(record, q, v, log, k, time)


@inner_kernel
def pushing_tick(record, q, v, log, k, time):
    """As `thesis_tick`, with joint torques for ground that only pushes; compiled only where a run asks for it."""
    c = record[0]
    sense_links(c, q, v)
    mass_matrix(c["tree"], c["at"], c["work"]["M"])
    return _decide(record, c["work"]["M"], q, v, log, k, time, (True,))


@kernel
def pushing_tick_in(record, M, h, J, bias, q, v, log, k, time):
    """As `thesis_tick_in`, likewise."""
    sense_links_in(record[0], J, q, v)
    sense_motion_in(record[0], h, bias)
    return _decide(record, M, q, v, log, k, time, (True,))
