"""What the system says in one state, and its constraints factored by the means that suit them."""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.compiled import shared
from biped.dynamics.linalg import SAFE_RATIO, apply_w, choose_rows, factor
from biped.dynamics.orthogonal import dot
from biped.dynamics.room import B_Q, B_V, EVALUATED, LAG, PHI, PLACE, RANK, RATIO, SPEED, Q, largest
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
