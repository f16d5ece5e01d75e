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

    M: np.ndarray  # (n, n) the mass matrix that R belongs to
    R: np.ndarray  # (n, n) lower triangle of Rᵀ
    C: np.ndarray  # (m, n) rows of A R⁻¹
    G: np.ndarray  # (m, m) Cholesky factor of CCᵀ
    H: np.ndarray  # (m, n) scaled, permuted rows of C: Householder vectors and the lower trapezoid T
    S: np.ndarray  # (m, m) columns of T as rows, then Householder vectors and the triangle of T = Q₂R₂
    scale: np.ndarray  # (m,) length every row of C was divided by
    order: np.ndarray  # (m,) row of C that stands at each place of H
    tau: np.ndarray  # (2, m) Householder coefficients of H and S
    x: np.ndarray  # (n,) scratch
    y: np.ndarray  # (m,) scratch
    rank: np.ndarray  # (2,) rank of C, and 1 if H holds the factors, 0 if G does
    ratio: np.ndarray  # (1,) smallest pivot over largest, 1 without constraints


def workspace(n: int, m: int) -> Workspace:
    """Room for the factors of a system of n coordinates and m constraints."""
    return Workspace(
        np.full((n, n), np.nan),
        np.zeros((n, n)),
        np.zeros((m, n)),
        np.zeros((m, m)),
        np.zeros((m, n)),
        np.zeros((m, m)),
        np.ones(m),
        np.zeros(m, np.int64),
        np.zeros((2, m)),
        np.zeros(n),
        np.zeros(m),
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
    """Complete orthogonal decomposition of C into w.H and w.S; sets rank and pivot ratio."""
    m, n = w.H.shape
    longest = 0.0
    for i in range(m):
        w.scale[i] = np.sqrt(dot(w.C[i], w.C[i]))
        longest = max(longest, w.scale[i])
    for i in range(m):
        # A row that is noise beside the others must not be blown up to their size.
        if w.scale[i] <= RANK_TOLERANCE * longest:
            w.scale[i] = longest if longest > 0.0 else 1.0
        w.order[i] = i
        for j in range(n):
            w.H[i, j] = w.C[i, j] / w.scale[i]
    rank, first, last = 0, 0.0, 1.0
    for k in range(min(m, n)):
        best, largest = k, -1.0
        for i in range(k, m):
            square = dot(w.H[i, k:], w.H[i, k:])
            if square > largest:
                best, largest = i, square
        pivot = np.sqrt(largest)
        if k == 0:
            first = pivot
        if not pivot > RANK_TOLERANCE * first:
            break
        if best != k:
            for j in range(n):
                w.H[k, j], w.H[best, j] = w.H[best, j], w.H[k, j]
            w.order[k], w.order[best] = w.order[best], w.order[k]
        w.tau[0, k] = reflector(w.H[k, k:])
        for i in range(k + 1, m):
            reflect(w.H[k, k:], w.tau[0, k], w.H[i, k:])
        rank, last = k + 1, pivot
    if rank < m:
        for j in range(rank):
            for i in range(m):
                w.S[j, i] = w.H[i, j] if i >= j else 0.0
        for j in range(rank):
            w.tau[1, j] = reflector(w.S[j, j:])
            for k in range(j + 1, rank):
                reflect(w.S[j, j:], w.tau[1, j], w.S[k, j:])
    w.rank[0], w.rank[1] = rank, 1
    w.ratio[0] = last / first if rank > 0 else 1.0


@kernel
def factor(M, A, w):
    """Factor M (n, n) and A (m, n) into w; False if M is not (numerically) positive definite.

    M's lower triangle alone is read, and factored only if it changed since the last call.
    """
    m, n = A.shape
    changed = False
    for i in range(n):
        for j in range(i + 1):
            changed = changed or M[i, j] != w.M[i, j]
    if changed:
        for i in range(n):
            for j in range(i + 1):
                w.M[i, j] = w.R[i, j] = M[i, j]
        if not cholesky(w.R) > n * 2.2e-16:
            w.M[0, 0] = np.nan
            return False
    for i in range(m):
        copy(A[i], w.C[i])
        solve_lower(w.R, w.C[i])
        for j in range(i + 1):
            w.G[i, j] = dot(w.C[i], w.C[j])
    w.rank[0], w.rank[1] = m, 0
    w.ratio[0] = np.sqrt(cholesky(w.G))
    if not w.ratio[0] > SAFE_RATIO:
        decompose(w)
    return True


@kernel
def solve_mass(Q, w, out):
    """Out = M⁻¹Q."""
    copy(Q, out)
    solve_lower(w.R, out)
    solve_lower_transposed(w.R, out)


@kernel
def apply_w(b, w, out):
    """Out = W b = R⁻¹C⁺b: the least motion, in the metric of M, that changes the constraints by b."""
    m, n = w.C.shape
    out[:] = 0.0
    if w.rank[1] == 0:
        copy(b, w.y)
        solve_lower(w.G, w.y)
        solve_lower_transposed(w.G, w.y)
        for i in range(m):
            for j in range(n):
                out[j] += w.C[i, j] * w.y[i]
    else:
        rank = w.rank[0]
        for i in range(m):
            w.y[i] = b[w.order[i]] / w.scale[w.order[i]]
        if rank == m:
            solve_lower(w.H, w.y)
        else:
            for j in range(rank):
                reflect(w.S[j, j:], w.tau[1, j], w.y[j:])
            for i in range(rank - 1, -1, -1):
                for k in range(i + 1, rank):
                    w.y[i] -= w.S[k, i] * w.y[k]
                w.y[i] /= w.S[i, i]
        for j in range(rank):
            out[j] = w.y[j]
        for k in range(rank - 1, -1, -1):
            reflect(w.H[k, k:], w.tau[0, k], out[k:])
    solve_lower_transposed(w.R, out)
