"""The stages of a step: the states that they are evaluated in, and the rates that follow."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.codes import INDEFINITE, NOT_FINITE, NOT_LEAPT, OK
from biped.dynamics.compiled import shared
from biped.dynamics.evaluate import apply, evaluate, find_lag, find_power, resolve
from biped.dynamics.linalg import apply_w, solve_mass
from biped.dynamics.orthogonal import copy, dot
from biped.dynamics.project import project
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
    copy(q, room.c[PLACE])
    copy(v, room.c[SPEED])
    for j in range(s):
        weight = step * tableau.A[s, j]
        if weight != 0.0:
            for i in range(q.shape[0]):
                room.c[PLACE, i] += weight * room.rate[0, j, i]
                room.c[SPEED, i] += weight * room.rate[1, j, i]


@kernel
def find_acceleration(s, settings, room):
    """Rates of stage s from its evaluation: v and v̇."""
    n, m = room.c.shape[1], room.r.shape[1]
    w = room.factors
    sparse = w.rank[1] == 2
    if not sparse:
        solve_mass(room.c[Q], w, room.c[ACCELERATION])
    for i in range(m):
        if not sparse:
            room.r[B_V, i] -= dot(room.A[i], room.c[ACCELERATION])
        if settings.correction == BAUMGARTE:
            room.r[B_V, i] += 2.0 * settings.alpha * room.r[LAG, i] - settings.beta**2 * room.r[PHI, i]
    for i in range(n):
        room.rate[0, s, i] = room.c[SPEED, i]
    if sparse:
        solve_sparse(room.M, room.A, room.c[Q], room.r[B_V], w.ratio[0], room.sparse, room.rate[1, s])
    else:
        apply_w(room.r[B_V], w, room.c[MOVE])
        for i in range(n):
            room.rate[1, s, i] = room.c[ACCELERATION, i] + room.c[MOVE, i]


@kernel
def find_rates(s, settings, room):
    """Rates of stage s, −WΦ̇ if it is the step's first; False if they are not finite."""
    find_acceleration(s, settings, room)
    if settings.correction == EMBEDDED:
        apply(room.r[LAG], room, room.c[MOVE])
        for i in range(room.c.shape[1]):
            room.rate[0, s, i] += room.c[MOVE, i]
        if s == 0:
            copy(room.c[MOVE], room.c[FIX_V])
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
        code, size = project(True, True, f, t, p, room)
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
            code, _ = project(False, False, f, ts, p, room)
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
    for s in range(tableau.b.shape[0]):
        room.weights[0, s] = tableau.b[s]
        room.weights[1, s], room.weights[2, s] = tableau.E[0, s], tableau.E[1, s]
    return OK, t + step, nearest, most, here


@kernel
def leave_step(step, q, v, room):
    """room.c[PLACE], room.c[SPEED] = the state at the end of the step; False if it is not finite."""
    for i in range(q.shape[0]):
        dq = dv = 0.0
        for s in range(room.rate.shape[1]):
            dq += room.weights[0, s] * room.rate[0, s, i]
            dv += room.weights[0, s] * room.rate[1, s, i]
        room.c[PLACE, i] = q[i] + (step * dq + room.c[FIX_Q, i])
        room.c[SPEED, i] = v[i] + (step * dv + room.c[FIX_V, i])
    return np.isfinite(largest(room.c[PLACE]) + largest(room.c[SPEED]))
