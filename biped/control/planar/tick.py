"""One control tick, fused and compiled: sense, decide the leg states (Fig 3.3), Q_d, joint torques, and the log's row.

The log row is written here because every number in it is at hand; its columns are those of `biped.measure.trajectory`.
"""

import math

from biped.base.jit import inner_kernel, kernel
from biped.control.blending import smooth
from biped.control.observer import compensate, remember
from biped.control.pace import excess, extended, flexed, leaned, straightened
from biped.control.planar.allocation import EXACT, bounded_torques, joint_torques
from biped.control.planar.floating import floating_torques
from biped.control.planar.observer import observe
from biped.control.planar.pushing import pushing_torques
from biped.control.planar.sensing import believe_contacts, first_belief, sense_links, sense_links_in, sense_motion_in
from biped.control.planar.setup import redraw
from biped.control.step_back import knee_couple, step_back, thigh_couple
from biped.robot.columns import ACTIVE, BELIEVED, HEIGHT, PHASE, Q_D, TIME, Q, U, V
from biped.robot.leg_states import EXTENDED, leg_state
from biped.robot.planar.kinematics import mass_matrix, speed_of_mass
from biped.robot.planar.topology import (
    ANKLE,
    HEEL,
    HIP,
    KNEE,
    LEGS,
    N_CONSTRAINTS,
    N_POINTS,
    NQ,
    NU,
    PITCH,
    THIGH,
    TOE,
    TORSO,
    X,
    Z,
)


@inner_kernel
def leg_states(c, q):
    """Writes the state of the right and the left leg (`biped.robot.leg_states.leg_state`) into the record."""
    memory, angle = c["memory"], c["at"]["angle"]
    for leg in range(LEGS):
        toe, heel = memory["believed"][TOE[leg]], memory["believed"][HEEL[leg]]
        thigh, other = angle[THIGH[leg]], angle[THIGH[1 - leg]]
        forward = thigh + 0.5 * math.pi + c["belief"]["tilt"]
        memory["phase"][leg] = leg_state(c["sensing"], toe, heel, thigh, other, forward, q[KNEE[leg]])


@inner_kernel
def torso_falls_back(c, q, v):
    """As `biped.control.step_back.step_back`, for the torso; places count from its origin."""
    rear = math.inf
    for i in range(N_POINTS):
        if c["memory"]["believed"][i]:
            rear = min(rear, c["at"]["point"][i, 0])
    step_back(c, 0.0, q[Z], v[X], c["belief"]["tilt"], rear)


@inner_kernel
def desired_forces(c, q, v):
    """Writes Q_d (9,) [N, N m] into the record from link angles, leg states and gains.

    Torso and thighs are held to the inertial frame, knees and ankles to their neighbours. In joint coordinates a knee's
    or ankle's couple is just its joint's torque, a thigh's acts on hip and pitch, the torso's on pitch (virtual work).
    A leg that steps back (`biped.control.step_back`) has a thigh couple of its own, and may have one of its knee, the
    others follow the walker's speed (`biped.control.pace`).
    """
    at, gait, memory, backstep = c["at"], c["gait"], c["memory"], c["backstep"]
    Q, angle, rate, k, b = c["tick"]["Q_d"], at["angle"], at["rate"], gait["k"], gait["b"]
    upright = 0.5 * math.pi + c["belief"]["tilt"]
    faster = excess(gait["pace"], speed_of_mass(c["tree"], at, v), c["belief"]["tilt"])
    Q[X] = 0.0
    Q[Z] = 0.0
    rest = gait["theta_b"] - leaned(gait["pace"], c["belief"]["tilt"])
    pitch = -gait["k_d1"] * (angle[TORSO] + upright - rest) - gait["b_d1"] * rate[TORSO]
    for leg in range(LEGS):
        s = memory["phase"][leg]
        thigh, hip, knee, ankle = THIGH[leg], HIP[leg], KNEE[leg], ANKLE[leg]
        back = memory["back"] and s == EXTENDED
        to_go = angle[thigh] + upright - backstep["theta_l"]
        if back:
            couple = thigh_couple(backstep, to_go, rate[thigh])
        else:
            rest = gait["theta_l"][s] + flexed(gait["pace"], s, faster)
            couple = -k[s, 0] * (angle[thigh] + upright - rest) - b[s, 0] * rate[thigh]
        pitch += couple
        Q[hip] = couple
        if back and backstep["k_d3"] > 0.0:
            Q[knee] = knee_couple(backstep, to_go, q[knee], v[knee])
        else:
            couple = -k[s, 1] * (q[knee] - gait["theta_k"][s]) - b[s, 1] * v[knee]
            Q[knee] = couple + straightened(gait["pace"], s, faster)
        Q[ankle] = -k[s, 2] * (q[ankle] - gait["theta_a"][s]) - b[s, 2] * v[ankle]
        Q[ankle] -= extended(gait["pace"], s, faster, c["belief"]["tilt"])
    Q[PITCH] = pitch


GOING, NOT_FINITE = 0, 3
"""Statuses that a tick of a law returns (`biped.engines.loop` has all of them): falls are judged by the engine."""


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
        torso_falls_back(c, q, v)
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
        record: (1,) `biped.control.planar.setup.CONTROL`; an array, because numba takes microseconds to recognise a
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
    observing = c["observer"]["follow"] > 0.0
    if observing:
        remember(c["observer"], c["tick"]["u"])
    desired_forces(c, q, v)
    if c["belief"]["redrawn"]:
        redraw(c["belief"])
    if len(pushing) > 0:
        pushing_torques(c, M, q, v)
        smooth(c["tick"]["u"], c["push"]["latest"], c["push"]["follow"], c["push"]["most"], k == 0)
    elif c["actuation"]["generalized"] == 0:
        c["tick"]["over"] = joint_torques(c, M, q) if c["belief"]["perturbed"] else floating_torques(c, M, q)
        if c["tick"]["over"] and c["actuation"]["bounded"] == EXACT:
            bounded_torques(c, M)
    if observing:
        observe(c, c["work"]["M"] if c["belief"]["perturbed"] else M, q, v, k == 0)
        compensate(c["observer"], c["tick"]["u"], c["actuation"]["limit"])
    c["memory"]["given_up"] += c["tick"]["given_up"]
    c["tick"]["given_up"] = 0
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
