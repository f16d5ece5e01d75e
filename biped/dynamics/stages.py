"""One stage of a step: the state it is evaluated in, what the system says there, and the rates that follow."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.compiled import shared
from biped.dynamics.linalg import SAFE_RATIO, apply_w, choose_rows, copy, dot, factor, solve_mass
from biped.dynamics.room import (
    ACCELERATION,
    B_Q,
    B_V,
    EVALUATED,
    FIX_Q,
    FIX_V,
    LAG,
    MOVE,
    PHI,
    PLACE,
    RANK,
    RATIO,
    SPEED,
    Q,
    largest,
)
from biped.dynamics.schemes import Correction
from biped.dynamics.sparse import SPARSE_RATIO, activate, clear, factor_sparse, row_products, solve_sparse

NONE, EMBEDDED, BAUMGARTE, PROJECTED = (int(c) for c in Correction)

OK, INDEFINITE, NOT_FINITE, NOT_PROJECTED, TOO_MANY_RETRIES, UNSETTLED, SPILLED, EVENT = range(8)
"""How a stage, a step or a march can end."""

PROJECTIONS = 30  # Newton iterations of a projection
PROJECTED_TO = 1e-14  # and the relative motion of q that ends them


@kernel
def zero(x):
    """Write zeros into every row of x."""
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            x[i, j] = 0.0


@kernel
def prepare(room):
    """Everything that the system's functions fill is full of zeros."""
    if room.sparse.use.shape[0] > 0:
        clear(room.M, room.sparse.M)
        clear(room.A, room.sparse.A)
    else:
        zero(room.M)
        zero(room.A)
    for x in (room.c[Q], room.r[PHI], room.r[B_Q], room.r[B_V]):
        for i in range(x.shape[0]):
            x[i] = 0.0


@shared
def evaluate(f, t, p, room):
    """Call the functions of the system at (t, room.c[PLACE], room.c[SPEED]): the only place that does."""
    prepare(room)
    f.mass(t, room.c[PLACE], room.c[SPEED], p, room.M)
    f.force(t, room.c[PLACE], room.c[SPEED], p, room.c[Q])
    f.phi(t, room.c[PLACE], room.c[SPEED], p, room.r[PHI])
    f.A(t, room.c[PLACE], room.c[SPEED], p, room.A)
    f.b_q(t, room.c[PLACE], room.c[SPEED], p, room.r[B_Q])
    f.b_v(t, room.c[PLACE], room.c[SPEED], p, room.r[B_V])
    room.seen[EVALUATED] += 1


@shared
def find_power(f, t, p, s, room):
    """room.power[s] = power of every force that is accounted for, of the stage."""
    for i in range(room.power.shape[1]):
        room.power[s, i] = 0.0
    f.power(t, room.c[PLACE], room.c[SPEED], p, room.power[s])


@kernel
def find_lag(room):
    """room.r[LAG] = b_q − A v, of the stage."""
    if room.sparse.use.shape[0] > 0:
        row_products(room.A, room.c[SPEED], room.sparse.A, room.r[LAG])
        for i in range(room.r.shape[1]):
            room.r[LAG, i] = room.r[B_Q, i] - room.r[LAG, i]
    else:
        for i in range(room.r.shape[1]):
            room.r[LAG, i] = room.r[B_Q, i] - dot(room.A[i], room.c[SPEED])


@kernel
def factor_any(room):
    """Factor M and the rows of A in use by the means that suit their size, see `linalg` and `sparse`."""
    w = room.factors
    if room.sparse.use.shape[0] > 0:
        w.ratio[0] = factor_sparse(room.M, room.A, room.sparse)
        w.rank[0], w.rank[1] = w.use[0], 2
        if w.ratio[0] > SPARSE_RATIO:
            return True
    return factor(room.M, room.A, w)


@kernel
def apply(b, room, out):
    """Out = W b, see `linalg.apply_w`."""
    if room.factors.rank[1] == 2:
        for i in range(out.shape[0]):
            out[i] = 0.0
        solve_sparse(room.M, room.A, out, b, room.factors.ratio[0], room.sparse, out)
    else:
        apply_w(b, room.factors, out)


@kernel
def resolve(choosing, room):
    """Factor what was just evaluated and find Φ̇; False if the mass matrix is not positive definite."""
    done = factor_any(room)
    w = room.factors
    if done and choosing and w.use[1] < min(w.C.shape[1], w.C.shape[2]) and not w.ratio[0] > SAFE_RATIO:
        done = choose_rows(room.M, room.A, w)
        if done and room.sparse.use.shape[0] > 0:
            activate(w.order[1], w.use[0], room.sparse)
            done = factor_any(room)
    if done:
        find_lag(room)
        room.seen[RATIO] = min(room.seen[RATIO], w.ratio[0])
        room.seen[RANK] = min(room.seen[RANK], w.rank[0])
    return done


@shared
def project(choosing, f, t, p, room):
    """Newton iterations, from a state just evaluated and factored, onto Φ = 0 and Φ̇ = 0.

    Returns:
        A code and the largest motion of q in one iteration.
    """
    before, size = np.inf, 0.0
    for iteration in range(PROJECTIONS + 1):
        apply(room.r[PHI], room, room.c[MOVE])
        moved = largest(room.c[MOVE])
        size = max(size, moved)
        # Close to a singularity rounding alone moves q by more than the tolerance: stop there, too.
        if moved <= PROJECTED_TO * (1.0 + largest(room.c[PLACE])) or 0.5 * before <= moved < 1e-6:
            apply(room.r[LAG], room, room.c[MOVE])
            for i in range(room.c.shape[1]):
                room.c[SPEED, i] += room.c[MOVE, i]
            find_lag(room)
            return OK, size
        if iteration == PROJECTIONS or not np.isfinite(moved):
            return NOT_PROJECTED, size
        for i in range(room.c.shape[1]):
            room.c[PLACE, i] -= room.c[MOVE, i]
        before = moved
        evaluate(f, t, p, room)
        if not resolve(choosing, room):
            return INDEFINITE, size
    return NOT_PROJECTED, size


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
def find_rates(s, settings, room):
    """Rates of stage s from its evaluation, −WΦ̇ if it is the step's first; False if they are not finite."""
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
    if settings.correction == EMBEDDED:
        apply(room.r[LAG], room, room.c[MOVE])
        for i in range(n):
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
    if settings.correction == PROJECTED or room.factors.ratio[0] < settings.settle:
        code, size = project(True, f, t, p, room)
        if code != OK:
            return code, size, energy
    if settings.energy:
        energy = scale_to_energy(energy, f.potential(t, room.c[PLACE], room.c[SPEED], p), room)
    copy(room.c[PLACE], q)
    copy(room.c[SPEED], v)
    find_power(f, t, p, 0, room)
    if settings.correction == EMBEDDED:
        apply(room.r[PHI], room, room.c[FIX_Q])
        for i in range(q.shape[0]):
            room.c[FIX_Q, i] *= -1.0
        size = max(size, largest(room.c[FIX_Q]))
    return OK if find_rates(0, settings, room) else NOT_FINITE, size, energy


@shared
def attempt(f, t, p, step, settings, tableau, q, v, room):
    """The other stages of a step.

    Returns:
        A code, the time it was reached [s], and the smallest pivot ratio and largest rank on the way.
    """
    nearest, rank = np.inf, 0
    for s in range(1, tableau.b.shape[0]):
        ts = t + tableau.c[s] * step
        enter_stage(s, step, tableau, q, v, room)
        evaluate(f, ts, p, room)
        if not resolve(False, room):
            return INDEFINITE, ts, nearest, rank
        nearest = min(nearest, room.factors.ratio[0])
        rank = max(rank, room.factors.rank[0])
        if room.factors.ratio[0] < settings.settle:
            code, _ = project(False, f, ts, p, room)
            if code != OK and settings.rtol > 0.0:
                return code, ts, nearest, rank
            if code != OK:  # a fixed step takes the stage as it came
                enter_stage(s, step, tableau, q, v, room)
                evaluate(f, ts, p, room)
                if not resolve(False, room):
                    return INDEFINITE, ts, nearest, rank
        find_power(f, ts, p, s, room)
        if not find_rates(s, settings, room):
            return NOT_FINITE, ts, nearest, rank
    return OK, t + step, nearest, rank


@kernel
def leave_step(step, tableau, q, v, room):
    """room.c[PLACE], room.c[SPEED] = the state at the end of the step; False if it is not finite."""
    for i in range(q.shape[0]):
        dq = dv = 0.0
        for s in range(tableau.b.shape[0]):
            dq += tableau.b[s] * room.rate[0, s, i]
            dv += tableau.b[s] * room.rate[1, s, i]
        room.c[PLACE, i] = q[i] + (step * dq + room.c[FIX_Q, i])
        room.c[SPEED, i] = v[i] + (step * dv + room.c[FIX_V, i])
    return np.isfinite(largest(room.c[PLACE]) + largest(room.c[SPEED]))
