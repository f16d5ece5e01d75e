"""One control tick, fused and compiled: sense, decide the leg states, Q_d, joint torques, and the row of the log.

The log row is written here because every number in it is at hand; its columns are those of `biped.measure.trajectory`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from biped.base.jit import kernel
from biped.control.allocation import joint_torques
from biped.control.backstep import step_back
from biped.control.phase import leg_states
from biped.control.sensing import believe_contacts, first_belief, sense_links
from biped.control.springs import desired_forces
from biped.measure.trajectory import ACTIVE, BELIEVED, FORCE, HEIGHT, PHASE, Q_D, STOP, TIME, Q, U, V
from biped.robot.tree import POINT_RADIUS

GOING, LOW, TILTED, NOT_FINITE = 0, 1, 2, 3
"""What a tick reports: the run goes on, the torso is too low, it leans too far, a number is not finite."""

Tick = Callable[[int, float], int]
"""One control tick (k, time [s]) of any law, bound to a run; returns what it reports."""


@kernel
def sense(record, J, q, v, first):
    """Links, believed contacts and leg states of this tick; returns GOING, LOW, TILTED or NOT_FINITE."""
    c = record[0]
    for j in range(9):
        if not (math.isfinite(q[j]) and math.isfinite(v[j])):
            return 3
    sense_links(c, J, q, v)
    if first:
        first_belief(c)
    else:
        believe_contacts(c)
    leg_states(c, q)
    if c["backstep"]:
        step_back(c, q, v)
    if q[1] < c["fall_height"]:
        return 1
    if abs(c["angle"][0] + c["tilt"]) > c["fall_tilt"]:
        return 2
    return 0


@kernel
def log_tick(record, q, v, log, k, time):
    """Writes row k of the log, except the ground forces, which belong to the step that follows."""
    c = record[0]
    line = log[k]
    line[TIME] = time
    for j in range(9):
        line[Q + j] = q[j]
        line[V + j] = v[j]
        line[Q_D + j] = c["Q_d"][j]
    for j in range(6):
        line[U + j] = c["u"][j]
        line[ACTIVE + j] = c["active"][j]
    for j in range(2):
        line[PHASE + j] = c["phase"][j] + 1
    for j in range(4):
        line[BELIEVED + j] = c["believed"][j]
        line[HEIGHT + j] = c["height"][j]


@kernel
def log_forces(log, k, efc_force, place, points, pyramid):
    """Writes the forces of ground and knee stops in the physics step that began at row k.

    MuJoCo lists joint limits first, then the contacts that exist in pair order. An elliptic cone has three rows each:
    normal, lateral and backward; a pyramid four edges, normal ± friction · lateral, then ± backward. A limit or contact
    exists where the joint or point is beyond it (no margin).

    Args:
        log: The log.
        k: Row; its configuration is the one the step began with.
        efc_force: (nefc,) MuJoCo's constraint forces [N, N m].
        place: (ngeom, 3) [m] geom positions in that configuration.
        points: (4,) numbers of the contact points' geoms.
        pyramid: Coefficient of friction of a pyramidal cone; 0 for an elliptic one.
    """
    rows = 4 if pyramid > 0.0 else 3
    touching = 0
    for i in range(4):
        if place[points[i], 2] < POINT_RADIUS:
            touching += 1
    at = efc_force.size - rows * touching
    limit = 0
    for leg in range(2):
        log[k, STOP + leg] = 0.0
        if log[k, Q + 4 + 3 * leg] > 0.0 and limit < at:
            log[k, STOP + leg] = -efc_force[limit]
            limit += 1
    for i in range(4):
        log[k, FORCE + 2 * i] = 0.0
        log[k, FORCE + 2 * i + 1] = 0.0
        if at >= 0 and place[points[i], 2] < POINT_RADIUS:
            if pyramid > 0.0:
                log[k, FORCE + 2 * i] = -pyramid * (efc_force[at + 2] - efc_force[at + 3])
                log[k, FORCE + 2 * i + 1] = efc_force[at] + efc_force[at + 1] + efc_force[at + 2] + efc_force[at + 3]
            else:
                log[k, FORCE + 2 * i] = -efc_force[at + 2]
                log[k, FORCE + 2 * i + 1] = efc_force[at]
            at += rows


@kernel
def thesis_tick(record, M, J, q, v, log, k, time):
    """The thesis's control law for one tick; u or Q_d is left in the record.

    Args:
        record: (1,) `biped.control.record.CONTROL`; an array, because numba takes microseconds to recognise a bare
            record.
        M: (9, 9) mass matrix, upper triangle (Pinocchio).
        J: (6, 9) world-frame joint Jacobian (Pinocchio).
        q: (9,) measured joint coordinates [m, rad].
        v: (9,) measured joint velocities [m/s, rad/s].
        log: (n, WIDTH) log, row k is written.
        k: Number of the tick.
        time: [s].

    Returns:
        GOING, LOW, TILTED or NOT_FINITE.
    """
    status = sense(record, J, q, v, k == 0)
    if status == 3:
        return status
    c = record[0]
    desired_forces(c, q, v)
    if c["generalized"] == 0:
        c["over"] = joint_torques(c, M, J, q)
    log_tick(record, q, v, log, k, time)
    return status
