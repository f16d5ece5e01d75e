"""The linear algebra of one stage: W = R⁻¹C⁺ with M = RᵀR and C = AR⁻¹, factored once and applied often.

The constraint matrix is factored by the cheapest means that is safe where the mechanism stands:

- CCᵀ = UᵀU by Cholesky when every row of C stands well off the span of the rows before it;
- a complete orthogonal decomposition (`orthogonal.py`: row-pivoted Householder LQ, then QR of the trapezoid when
  rank is missing) otherwise: redundant rows, kinematic singularities and their neighbourhood.

Both are blind to the units of a constraint: rows are compared with their own length.
"""

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.orthogonal import copy, decompose, reflect
from biped.numerics.factor import solve_transposed

SAFE_RATIO = 1e-2
"""Smallest pivot ratio at which CCᵀ is formed: squaring it costs no more than four of sixteen digits."""


@kernel
def cholesky(G):
    """Factor G = LLᵀ in place (lower triangle); return the smallest pivot over its own diagonal entry.

    The value returned is 1 − cos² of a row's angle to the span of the rows before it; zero or less (or nan)
    says that G is not positive definite and was left half factored.
    """
    least = 1.0
    for j in range(G.shape[0]):
        diagonal = G[j, j]
        pivot = diagonal
        for k in range(j):
            pivot -= G[j, k] * G[j, k]
        if not (diagonal > 0.0 and pivot > 0.0):
            return 0.0
        least = min(least, pivot / diagonal)
        root = np.sqrt(pivot)
        G[j, j] = root
        for i in range(j + 1, G.shape[0]):
            s = G[i, j]
            for k in range(j):
                s -= G[i, k] * G[j, k]
            G[i, j] = s / root
    return least


@kernel
def subtract(x, share, y):
    """Overwrite x with x − share·y."""
    for i in range(x.shape[0]):
        x[i] -= share * y[i]


@kernel
def cholesky_upper(G):
    """Factor G = UᵀU in place (upper triangle), row by row: the same numbers as `cholesky`, several at a time.

    Returns:
        What `cholesky` returns.
    """
    m, least = G.shape[0], 1.0
    for j in range(m):
        # The diagonal below the first row has been reduced already: what it was is kept beside it, in column 0.
        diagonal, pivot = G[j, j] if j == 0 else G[j, 0], G[j, j]
        if not (diagonal > 0.0 and pivot > 0.0):
            return 0.0
        least = min(least, pivot / diagonal)
        root = np.sqrt(pivot)
        G[j, j] = root
        for i in range(j + 1, m):
            G[j, i] /= root
        for i in range(j + 1, m):
            share = G[j, i]
            if share != 0.0:
                subtract(G[i, i:], share, G[j, i:])
    return least


@kernel
def solve_upper_transposed(U, x):
    """Overwrite x with U⁻ᵀx."""
    for k in range(x.shape[0]):
        x[k] /= U[k, k]
        for i in range(k + 1, x.shape[0]):
            x[i] -= U[k, i] * x[k]


@kernel
def solve_upper(U, x):
    """Overwrite x with U⁻¹x."""
    for i in range(x.shape[0] - 1, -1, -1):
        s = x[i]
        for k in range(x.shape[0] - 1, i, -1):
            s -= U[i, k] * x[k]
        x[i] = s / U[i, i]


@kernel
def solve_lower_transposed(L, x):
    """Overwrite x with L⁻ᵀx."""
    for i in range(x.shape[0] - 1, -1, -1):
        x[i] /= L[i, i]
        for k in range(i):
            x[k] -= L[i, k] * x[i]


@kernel
def factor(M, A, w):
    """Factor M (n, n) and the rows in use of A (m, n) into w; False if M is not (numerically) positive definite.

    M's lower triangle alone is read, and factored only if it changed since the last call.
    """
    return factor_mass(M, w) and factor_rows(A, w)


@kernel
def factor_mass(M, w):
    """Factor M unless it is there already; False if M is not (numerically) positive definite."""
    n = M.shape[0]
    known, R = w.mass[0], w.mass[1]
    changed = False
    for i in range(n):
        for j in range(i + 1):
            changed = changed or M[i, j] != known[i, j]
    if changed:
        for i in range(n):
            for j in range(i + 1):
                known[i, j] = R[i, j] = M[i, j]
        if not cholesky(R) > n * 2.2e-16:
            known[0, 0] = np.nan
            return False
    return True


@kernel
def factor_rows(A, w):
    """Factor the rows of C in use by the cheapest means that is safe.

    Every inner loop runs along a row of Cᵀ or of the triangle: the processor takes several of its numbers at once,
    and what is zero in R or C is passed over.
    """
    m, n = w.use[0], A.shape[1]
    C, G, L, order = w.C, w.G[0], w.mass[1], w.order[1]
    for j in range(m):
        row = A[order[j]]
        for i in range(n):
            C[i, j] = row[i]
    for i in range(n):
        for k in range(i):
            share = L[i, k]
            if share != 0.0:
                subtract(C[i, :m], share, C[k, :m])
        for j in range(m):
            C[i, j] /= L[i, i]
    w.rank[0], w.rank[1], w.ratio[0] = m, 0, 0.0
    if m <= w.use[1]:
        for i in range(m):
            for j in range(i, m):
                G[i, j] = 0.0
        for k in range(n):
            for i in range(m):
                share = C[k, i]
                if share != 0.0:
                    subtract(G[i, i:m], -share, C[k, i:m])
        for i in range(1, m):
            G[i, 0] = G[i, i]
        w.ratio[0] = np.sqrt(cholesky_upper(G[:m, :m]))
    if not w.ratio[0] > SAFE_RATIO:
        decompose(w)
    return True


@kernel
def use_all(w):
    """Put every row of A in use."""
    w.use[0] = w.order.shape[1]
    for i in range(w.use[0]):
        w.order[1, i] = i


@kernel
def choose_rows(M, A, w):
    """Put as many rows in use as the constraints have rank, the most independent ones; factor all or those.

    Constraints that depend on each other on Φ = 0 do so only nearly at the stages of a step, which are a little
    off: there the surplus rows would stand for forces that do not exist. Rows are chosen at the start of a step,
    where the mechanism is nearest to its constraints, and kept as long as they stand well apart. Where even the
    rank that the constraints have is not there (a singular position) all rows stay in use, up to that rank.
    """
    use_all(w)
    if not (factor_mass(M, w) and factor_rows(A, w)):
        return False
    if w.rank[0] == w.use[1]:
        w.use[0] = w.use[1]
        for i in range(w.order.shape[1]):
            w.order[1, i] = w.order[0, i]
        return factor_rows(A, w)
    return True


@kernel
def solve_mass(Q, w, out):
    """Out = M⁻¹Q."""
    copy(Q, out)
    solve_transposed(w.mass[1].T, out)
    solve_lower_transposed(w.mass[1], out)


@kernel
def apply_w(b, w, out):
    """Out = W b = R⁻¹C⁺b: the least motion, in the metric of M, that changes the constraints by b."""
    m, n = w.use[0], w.C.shape[0]
    tau, x, order = w.tau, w.tau[3, :m], w.order
    if w.rank[1] == 0:
        C, G = w.C, w.G[0, :m, :m]
        for i in range(m):
            x[i] = b[order[1, i]]
        solve_upper_transposed(G, x)
        solve_upper(G, x)
        for j in range(n):
            s = 0.0
            for i in range(m):
                s += C[j, i] * x[i]
            out[j] = s
    else:
        T, G, rank = w.T, w.G[1], w.rank[0]
        out[:] = 0.0
        for i in range(m):
            x[i] = b[order[1, order[0, i]]] / tau[2, order[0, i]]
        if rank == m:
            solve_transposed(T[:m, :m].T, x)
        else:
            for j in range(rank):
                reflect(G[j, j:m], tau[1, j], x[j:])
            for i in range(rank - 1, -1, -1):
                for k in range(i + 1, rank):
                    x[i] -= G[k, i] * x[k]
                x[i] /= G[i, i]
        for j in range(rank):
            out[j] = x[j]
        for k in range(rank - 1, -1, -1):
            reflect(T[k, k:], tau[0, k], out[k:])
    solve_lower_transposed(w.mass[1], out)
