"""The stages of a step: the states that they are evaluated in, and the rates that follow."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.compiled import INDEFINITE, NOT_FINITE, NOT_LEAPT, OK, shared
from biped.dynamics.evaluate import apply, evaluate, find_lag, find_power, project, resolve
from biped.dynamics.linalg import apply_w, solve_mass
from biped.dynamics.orthogonal import copy, dot
from biped.dynamics.room import ACCELERATION, B_V, FIX_Q, FIX_V, LAG, MOVE, PHI, PLACE, SPEED, Q, largest
from biped.dynamics.schemes import Correction
from biped.dynamics.sparse import solve_sparse

NONE, EMBEDDED, BAUMGARTE, PROJECTED = (int(c) for c in Correction)

SHOWN = 0.9
"""Part of its largest value to which the pivot ratio falls within a step where a singular position is near; masses
that differ much make it small everywhere."""


@kernel
def enter_stage(s, step, tableau, q, v, room):
    """room.c[PLACE], room.c[SPEED] = the state in which stage s is evaluated."""
    place, speed, rate, weights = room.c[PLACE], room.c[SPEED], room.rate, tableau.A[s]
    copy(q, place)
    copy(v, speed)
    for j in range(s):
        weight = step * weights[j]
        if weight != 0.0:
            for i in range(q.shape[0]):
                place[i] += weight * rate[0, j, i]
                speed[i] += weight * rate[1, j, i]


@kernel
def find_acceleration(s, settings, room):
    """Rates of stage s from its evaluation: v and v̇. With few entries room.c[MOVE] = −WΦ̇ comes with them."""
    w, A, free, move, b_v = room.factors, room.A, room.c[ACCELERATION], room.c[MOVE], room.r[B_V]
    rate, lag = room.rate[1, s], room.r[LAG]
    copy(room.c[SPEED], room.rate[0, s])
    sparse = w.rank[1] == 2
    if not sparse:
        solve_mass(room.c[Q], w, free)
        for i in range(b_v.shape[0]):
            b_v[i] -= dot(A[i], free)
    if settings.correction == BAUMGARTE:
        for i in range(b_v.shape[0]):
            b_v[i] += 2.0 * settings.alpha * lag[i] - settings.beta**2 * room.r[PHI, i]
    if sparse:
        solve_sparse(room.M, A, room.c[Q], b_v, lag, w.ratio[0], room.sparse, rate, move)
    else:
        apply_w(b_v, w, move)
        for i in range(rate.shape[0]):
            rate[i] = free[i] + move[i]


@kernel
def find_rates(s, settings, room):
    """Rates of stage s, −WΦ̇ if it is the step's first; False if they are not finite."""
    find_acceleration(s, settings, room)
    if settings.correction == EMBEDDED:
        move, rate = room.c[MOVE], room.rate[0, s]
        if room.factors.rank[1] != 2:
            apply_w(room.r[LAG], room.factors, move)
        for i in range(move.shape[0]):
            rate[i] += move[i]
        if s == 0:
            copy(move, room.c[FIX_V])
    return np.isfinite(largest(room.rate[0, s]) + largest(room.rate[1, s]))


@kernel
def scale_to_energy(energy, potential, room):
    """Scale v so that ½vᵀMv + V = energy, where that is a small change; return the energy held."""
    kinetic = 0.0
    for i in range(room.c.shape[1]):
        kinetic += 0.5 * room.c[SPEED, i] * dot(room.M[i], room.c[SPEED])
    if np.isnan(energy):
        return kinetic + potential
    if kinetic > 0.0:
        square = (energy - potential) / kinetic
        # At a turning point the kinetic energy is smaller than its error: nothing to be learnt there.
        if 0.81 < square < 1.21:
            for i in range(room.c.shape[1]):
                room.c[SPEED, i] *= np.sqrt(square)
            find_lag(room)
    return energy


@shared
def begin(f, t, p, settings, energy, q, v, room):
    """The first stage of a step from (q, v), which it corrects or projects as the scheme says.

    Returns:
        A code, the size of the correction of q, and the energy that is held.
    """
    copy(q, room.c[PLACE])
    copy(v, room.c[SPEED])
    evaluate(f, t, p, room)
    size = 0.0
    if not resolve(True, room):
        return INDEFINITE, size, energy
    settled = room.factors.ratio[0] < settings.settle
    if settings.correction == PROJECTED or settled:
        code, size = project(True, True, room.c[PLACE, :0], 0.0, f, t, p, room)
        if code != OK:
            return code, size, energy
    if settings.energy:
        energy = scale_to_energy(energy, f.potential(t, room.c[PLACE], room.c[SPEED], p), room)
    copy(room.c[PLACE], q)
    copy(room.c[SPEED], v)
    find_power(f, t, p, 0, room)
    if settled:
        for i in range(q.shape[0]):
            room.c[FIX_Q, i] = room.c[FIX_V, i] = 0.0
        find_acceleration(0, settings, room)
        return OK, size, energy
    if settings.correction == EMBEDDED:
        apply(room.r[PHI], room, room.c[FIX_Q])
        for i in range(q.shape[0]):
            room.c[FIX_Q, i] *= -1.0
        size = max(size, largest(room.c[FIX_Q]))
    return OK if find_rates(0, settings, room) else NOT_FINITE, size, energy


@kernel
def is_near(low, high, settings):
    """Whether pivot ratios between these two show a singular position: small, and not everywhere."""
    return low < settings.settle and low < SHOWN * high


@shared
def attempt(watching, f, t, p, step, ratio, rank, settings, tableau, q, v, room):
    """The other stages of a step from a start of this pivot ratio and rank.

    `watching` says whether to give up (`NOT_LEAPT`) as soon as a singular position is seen nearby.

    Returns:
        A code, the time it was reached [s], the smallest pivot ratio and the largest rank on the way, and the pivot
        ratio that the last stage came to.
    """
    nearest, highest, most = np.inf, ratio, 0
    here = ratio
    for s in range(1, tableau.b.shape[0]):
        ts = t + tableau.c[s] * step
        enter_stage(s, step, tableau, q, v, room)
        evaluate(f, ts, p, room)
        if not resolve(False, room):
            return INDEFINITE, ts, nearest, most, here
        here = room.factors.ratio[0]
        nearest, highest = min(nearest, here), max(highest, here)
        most = max(most, room.factors.rank[0])
        if watching and (most > rank or is_near(min(ratio, nearest), highest, settings)):
            return NOT_LEAPT, ts, nearest, most, here
        if here < settings.settle:
            code, _ = project(False, False, room.c[PLACE, :0], 0.0, f, ts, p, room)
            if code != OK and settings.rtol > 0.0:
                return code, ts, nearest, most, here
            if code != OK:  # a fixed step takes the stage as it came
                enter_stage(s, step, tableau, q, v, room)
                evaluate(f, ts, p, room)
                if not resolve(False, room):
                    return INDEFINITE, ts, nearest, most, here
        find_power(f, ts, p, s, room)
        if not find_rates(s, settings, room):
            return NOT_FINITE, ts, nearest, most, here
    weights, b, E = room.weights, tableau.b, tableau.E
    for s in range(b.shape[0]):
        weights[0, s], weights[1, s], weights[2, s] = b[s], E[0, s], E[1, s]
    return OK, t + step, nearest, most, here


@kernel
def leave_step(step, q, v, room):
    """room.c[PLACE], room.c[SPEED] = the state at the end of the step; False if it is not finite."""
    c, rate, weights = room.c, room.rate, room.weights[0]
    for i in range(q.shape[0]):
        dq = dv = 0.0
        for s in range(rate.shape[1]):
            dq += weights[s] * rate[0, s, i]
            dv += weights[s] * rate[1, s, i]
        c[PLACE, i] = q[i] + (step * dq + c[FIX_Q, i])
        c[SPEED, i] = v[i] + (step * dv + c[FIX_V, i])
    return np.isfinite(largest(room.c[PLACE]) + largest(room.c[SPEED]))
