"""The linear algebra of one stage: W = R⁻¹C⁺ with M = RᵀR and C = AR⁻¹, factored once and applied often.

The constraint matrix is factored by the cheapest means that is safe where the mechanism stands:

- CCᵀ by Cholesky when every row of C stands well off the span of the rows before it;
- a complete orthogonal decomposition (row-pivoted Householder LQ, then QR of the trapezoid when rank is
  missing) otherwise: redundant rows, kinematic singularities and their neighbourhood.

Both are blind to the units of a constraint: rows are compared with their own length.
"""

from typing import NamedTuple

import numpy as np

from biped.base.jit import kernel

RANK_TOLERANCE = 1e-12
"""A row of C closer than this (relative, rows scaled to length one) to the span of the others is dependent.

Any value from 1e-15 to 1e-8 gives the same four-bar trajectories; 1e-6 and more drop a force that is really
there, because the 0/0 limit of (2.11) at a singularity is finite.
"""

SAFE_RATIO = 1e-2
"""Smallest pivot ratio at which CCᵀ is formed: squaring it costs no more than four of sixteen digits."""


class Workspace(NamedTuple):
    """Factors of one stage; every array is overwritten by the next call of `factor`."""

    mass: np.ndarray  # (2, n, n) the mass matrix that R belongs to, and the lower triangle R of Rᵀ
    C: np.ndarray  # (2, m, n) rows of A R⁻¹; scaled and permuted: Householder vectors and the lower trapezoid T
    G: np.ndarray  # (2, m, m) Cholesky factor of CCᵀ; columns of T as rows, then those of T = Q₂R₂
    tau: np.ndarray  # (4, m) Householder coefficients of T and of R₂, what rows of C were divided by, scratch
    order: np.ndarray  # (2, m) row of C that stands at each place of T; the rows of A in use, use[0] of them
    use: np.ndarray  # (2,) number of rows in use, and the largest rank that the constraints may have
    rank: np.ndarray  # (2,) rank of C, and which factors hold: 0 G[0], 1 C[1], 2 `Sparse`
    ratio: np.ndarray  # (1,) smallest pivot over largest, 1 without constraints


def workspace(n: int, m: int) -> Workspace:
    """Room for the factors of a system of n coordinates and m constraints."""
    return Workspace(
        np.full((2, n, n), np.nan),
        np.zeros((2, m, n)),
        np.zeros((2, m, m)),
        np.ones((4, m)),
        np.array([np.arange(m), np.arange(m)]),
        np.array([m, min(n, m)]),
        np.zeros(2, np.int64),
        np.ones(1),
    )


@kernel
def copy(x, out):
    """Write x into out."""
    for i in range(x.shape[0]):
        out[i] = x[i]


@kernel
def dot(x, y):
    """xᵀy, without BLAS: at these lengths the call alone costs more than the sum."""
    s = 0.0
    for i in range(x.shape[0]):
        s += x[i] * y[i]
    return s


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
def solve_lower(L, x):
    """Overwrite x with L⁻¹x."""
    for i in range(x.shape[0]):
        s = x[i]
        for k in range(i):
            s -= L[i, k] * x[k]
        x[i] = s / L[i, i]


@kernel
def solve_lower_transposed(L, x):
    """Overwrite x with L⁻ᵀx."""
    for i in range(x.shape[0] - 1, -1, -1):
        x[i] /= L[i, i]
        for k in range(i):
            x[k] -= L[i, k] * x[i]


@kernel
def reflector(x):
    """Overwrite x with (β, tail of u) such that (I − τ[1,u][1,u]ᵀ)x = βe₁; return τ."""
    square = 0.0
    for i in range(1, x.shape[0]):
        square += x[i] * x[i]
    if square == 0.0:
        return 0.0
    alpha = x[0]
    beta = -np.copysign(np.sqrt(alpha * alpha + square), alpha)
    for i in range(1, x.shape[0]):
        x[i] /= alpha - beta
    x[0] = beta
    return (beta - alpha) / beta


@kernel
def reflect(u, tau, x):
    """Overwrite x with (I − τ[1,u₁…][1,u₁…]ᵀ)x."""
    s = x[0]
    for i in range(1, x.shape[0]):
        s += u[i] * x[i]
    s *= tau
    x[0] -= s
    for i in range(1, x.shape[0]):
        x[i] -= s * u[i]


@kernel
def decompose(w):
    """Complete orthogonal decomposition of C into C[1] and G[1]; sets rank and pivot ratio."""
    m, n, most = w.use[0], w.C.shape[2], w.use[1]
    longest = 0.0
    for i in range(m):
        w.tau[2, i] = np.sqrt(dot(w.C[0, i], w.C[0, i]))
        longest = max(longest, w.tau[2, i])
    for i in range(m):
        # A row that is noise beside the others must not be blown up to their size.
        if w.tau[2, i] <= RANK_TOLERANCE * longest:
            w.tau[2, i] = longest if longest > 0.0 else 1.0
        w.order[0, i] = i
        for j in range(n):
            w.C[1, i, j] = w.C[0, i, j] / w.tau[2, i]
    rank, first, last = 0, 0.0, 1.0
    for k in range(min(m, n, most)):
        best, largest = k, -1.0
        for i in range(k, m):
            square = dot(w.C[1, i, k:], w.C[1, i, k:])
            if square > largest:
                best, largest = i, square
        pivot = np.sqrt(largest)
        if k == 0:
            first = pivot
        if not pivot > RANK_TOLERANCE * first:
            break
        if best != k:
            for j in range(n):
                w.C[1, k, j], w.C[1, best, j] = w.C[1, best, j], w.C[1, k, j]
            w.order[0, k], w.order[0, best] = w.order[0, best], w.order[0, k]
        w.tau[0, k] = reflector(w.C[1, k, k:])
        for i in range(k + 1, m):
            reflect(w.C[1, k, k:], w.tau[0, k], w.C[1, i, k:])
        rank, last = k + 1, pivot
    if rank < m:
        for j in range(rank):
            for i in range(m):
                w.G[1, j, i] = w.C[1, i, j] if i >= j else 0.0
        for j in range(rank):
            w.tau[1, j] = reflector(w.G[1, j, j:m])
            for k in range(j + 1, rank):
                reflect(w.G[1, j, j:m], w.tau[1, j], w.G[1, k, j:m])
    w.rank[0], w.rank[1] = rank, 1
    w.ratio[0] = last / first if rank > 0 else 1.0


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
    changed = False
    for i in range(n):
        for j in range(i + 1):
            changed = changed or M[i, j] != w.mass[0, i, j]
    if changed:
        for i in range(n):
            for j in range(i + 1):
                w.mass[0, i, j] = w.mass[1, i, j] = M[i, j]
        if not cholesky(w.mass[1]) > n * 2.2e-16:
            w.mass[0, 0, 0] = np.nan
            return False
    return True


@kernel
def factor_rows(A, w):
    """Factor the rows of C in use by the cheapest means that is safe."""
    m = w.use[0]
    for i in range(m):
        copy(A[w.order[1, i]], w.C[0, i])
        solve_lower(w.mass[1], w.C[0, i])
        for j in range(i + 1):
            w.G[0, i, j] = dot(w.C[0, i], w.C[0, j])
    w.rank[0], w.rank[1] = m, 0
    w.ratio[0] = np.sqrt(cholesky(w.G[0, :m, :m])) if m <= w.use[1] else 0.0
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
    solve_lower(w.mass[1], out)
    solve_lower_transposed(w.mass[1], out)


@kernel
def apply_w(b, w, out):
    """Out = W b = R⁻¹C⁺b: the least motion, in the metric of M, that changes the constraints by b."""
    n = w.C.shape[2]
    m = w.use[0]
    out[:] = 0.0
    if w.rank[1] == 0:
        for i in range(m):
            w.tau[3, i] = b[w.order[1, i]]
        solve_lower(w.G[0, :m, :m], w.tau[3, :m])
        solve_lower_transposed(w.G[0, :m, :m], w.tau[3, :m])
        for i in range(m):
            for j in range(n):
                out[j] += w.C[0, i, j] * w.tau[3, i]
    else:
        rank = w.rank[0]
        for i in range(m):
            w.tau[3, i] = b[w.order[1, w.order[0, i]]] / w.tau[2, w.order[0, i]]
        if rank == m:
            solve_lower(w.C[1, :m], w.tau[3, :m])
        else:
            for j in range(rank):
                reflect(w.G[1, j, j:m], w.tau[1, j], w.tau[3, j:m])
            for i in range(rank - 1, -1, -1):
                for k in range(i + 1, rank):
                    w.tau[3, i] -= w.G[1, k, i] * w.tau[3, k]
                w.tau[3, i] /= w.G[1, i, i]
        for j in range(rank):
            out[j] = w.tau[3, j]
        for k in range(rank - 1, -1, -1):
            reflect(w.C[1, k, k:], w.tau[0, k], out[k:])
    solve_lower_transposed(w.mass[1], out)
