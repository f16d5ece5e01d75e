"""Evaluation and factorisation of a system in compiled code, and projection onto its constraints."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.compiled import INDEFINITE, NOT_PROJECTED, OK, shared
from biped.dynamics.linalg import SAFE_RATIO, apply_w, choose_rows, factor
from biped.dynamics.orthogonal import dot
from biped.dynamics.room import AIM, B_Q, B_V, EVALUATED, LAG, MOVE, PHI, PLACE, RANK, RATIO, SPEED, Q, largest
from biped.dynamics.sparse import SPARSE_RATIO, activate, clear, factor_sparse, row_products, solve_sparse


@kernel
def zero(x):
    """Write zeros into every row of x."""
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            x[i, j] = 0.0


@kernel
def prepare(room):
    """Everything that the system's functions fill is full of zeros."""
    K, r = room.sparse, room.r
    if K.use.shape[0] > 0:
        clear(room.M, K.M)
        clear(room.A, K.A)
    else:
        zero(room.M)
        zero(room.A)
    for x in (room.c[Q], r[PHI], r[B_Q], r[B_V]):
        for i in range(x.shape[0]):
            x[i] = 0.0


@shared
def evaluate(f, t, p, room):
    """Call the functions of the system at (t, room.c[PLACE], room.c[SPEED]): the only place that does."""
    prepare(room)
    q, v, r = room.c[PLACE], room.c[SPEED], room.r
    f.mass(t, q, v, p, room.M)
    f.force(t, q, v, p, room.c[Q])
    f.phi(t, q, v, p, r[PHI])
    f.A(t, q, v, p, room.A)
    f.b_q(t, q, v, p, r[B_Q])
    f.b_v(t, q, v, p, r[B_V])
    room.seen[EVALUATED] += 1


@shared
def renew(f, t, p, room):
    """Call those functions again that depend on v, after room.c[SPEED] alone has changed."""
    for x in (room.c[Q], room.r[B_V]):
        for i in range(x.shape[0]):
            x[i] = 0.0
    f.force(t, room.c[PLACE], room.c[SPEED], p, room.c[Q])
    f.b_v(t, room.c[PLACE], room.c[SPEED], p, room.r[B_V])


@shared
def find_power(f, t, p, s, room):
    """room.power[s] = power of every force that is accounted for, of the stage."""
    power = room.power[s]
    if power.shape[0] == 0:
        return
    for i in range(power.shape[0]):
        power[i] = 0.0
    f.power(t, room.c[PLACE], room.c[SPEED], p, power)


@kernel
def product(x, room, out):
    """Out = A x, of the stage."""
    A = room.A
    if room.sparse.use.shape[0] > 0:
        row_products(A, x, room.sparse.A, out)
    else:
        for i in range(out.shape[0]):
            out[i] = dot(A[i], x)


@kernel
def find_lag(room):
    """room.r[LAG] = b_q − A v, of the stage."""
    b_q, lag = room.r[B_Q], room.r[LAG]
    product(room.c[SPEED], room, lag)
    for i in range(lag.shape[0]):
        lag[i] = b_q[i] - lag[i]


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
        solve_sparse(room.M, room.A, out[:0], b[:0], b, room.factors.ratio[0], room.sparse, out[:0], out)
    else:
        apply_w(b, room.factors, out)


@kernel
def resolve(choosing, room):
    """Factor what was just evaluated and find Φ̇; False if M is not positive definite, or Φ, A or b_q no number.

    A row that is no number would be taken for a dependent one, and dropped without a word.
    """
    done = factor_any(room)
    w, seen = room.factors, room.seen
    if done and choosing and w.use[1] < min(w.T.shape[0], w.T.shape[1]) and not w.ratio[0] > SAFE_RATIO:
        done = choose_rows(room.M, room.A, w)
        if done and room.sparse.use.shape[0] > 0:
            activate(w.order[1], w.use[0], room.sparse)
            done = factor_any(room)
    if done:
        find_lag(room)
        seen[RATIO] = min(seen[RATIO], w.ratio[0])
        seen[RANK] = min(seen[RANK], w.rank[0])
        done = np.isfinite(largest(room.r[PHI]) + largest(room.r[LAG]))
    return done


PROJECTIONS = 30  # Newton iterations of a projection
PROJECTED_TO = 1e-14  # and the relative motion of q that ends them
ROUNDING = 4e-16  # relative error of Φ and Φ̇ as they are computed
PLAIN = 0.1  # pivot ratio below which what a place is off by makes itself felt by its square


@kernel
def is_noise(moved, size, ratio, power):
    """Whether a correction is no larger than its own rounding error.

    Φ is computed to within ε, and its correction to within ε/ratio; Φ̇ is off by what A is off by, which is
    that, and its correction by ε/ratio².
    """
    return moved * ratio**power <= ROUNDING * (1.0 + size)


@kernel
def find_move(away, room):
    """room.c[MOVE] = what takes the place of the stage, subtracted, onto Φ = 0.

    Of all such motions the least one, or, of a place that has been moved by `away` (n,), the one that leaves it
    nearest to where it was before: what was moved along the constraints for nothing is taken back.
    """
    move = room.c[MOVE]
    if away.shape[0] == 0:
        apply(room.r[PHI], room, move)
        return
    product(away, room, room.r[AIM])
    for i in range(room.r.shape[1]):
        room.r[AIM, i] = room.r[PHI, i] - room.r[AIM, i]
    apply(room.r[AIM], room, move)
    for i in range(move.shape[0]):
        move[i] += away[i]


@shared
def project(gentle, choosing, away, within, f, t, p, room):
    """Newton iterations, from a state just evaluated and factored, onto Φ = 0 and Φ̇ = 0.

    `away` (n,) is what the place has been moved by already (`find_move`), and is kept so; empty: nothing that counts.
    `within` is the relative motion of q that ends the iterations where nothing singular is near; 0: to rounding.

    Beside a singular position the start of a step, which the step before left as it is, has the better velocities:
    `gentle` leaves them where their correction is rounding. A stage or a node has not, and what it does not lose
    there comes back enlarged, because the acceleration answers with −2Δv/t.

    Returns:
        A code and the largest motion of q in one iteration.
    """
    before, size = np.inf, 0.0
    for iteration in range(PROJECTIONS + 1):
        find_move(away, room)
        moved, ratio = largest(room.c[MOVE]), room.factors.ratio[0]
        size = max(size, moved)
        # Close to a singularity rounding alone moves q by more than the tolerance: stop there, too.
        if (
            moved <= max(PROJECTED_TO, within * min(1.0, (ratio / PLAIN) ** 4)) * (1.0 + largest(room.c[PLACE]))
            or is_noise(moved, largest(room.c[PLACE]), ratio, 1)
            or 0.5 * before <= moved < 1e-6
        ):
            apply(room.r[LAG], room, room.c[MOVE])
            if not (gentle and is_noise(largest(room.c[MOVE]), largest(room.c[SPEED]), ratio, 2)):
                for i in range(room.c.shape[1]):
                    room.c[SPEED, i] += room.c[MOVE, i]
                find_lag(room)
                renew(f, t, p, room)
            return OK, size
        if iteration == PROJECTIONS or not np.isfinite(moved):
            return NOT_PROJECTED, size
        for i in range(room.c.shape[1]):
            room.c[PLACE, i] -= room.c[MOVE, i]
        for i in range(away.shape[0]):
            away[i] -= room.c[MOVE, i]
        before = moved
        evaluate(f, t, p, room)
        if not resolve(choosing, room):
            return INDEFINITE, size
    return NOT_PROJECTED, size
