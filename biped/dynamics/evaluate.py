"""What the system says in one state, and its constraints factored by the means that suit them."""

from biped.base.jit import kernel
from biped.dynamics.compiled import shared
from biped.dynamics.linalg import SAFE_RATIO, apply_w, choose_rows, factor
from biped.dynamics.orthogonal import dot
from biped.dynamics.room import B_Q, B_V, EVALUATED, LAG, PHI, PLACE, RANK, RATIO, SPEED, Q
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
    if room.power.shape[1] == 0:
        return
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
