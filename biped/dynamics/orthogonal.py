"""Rows of C that may depend on each other: a complete orthogonal decomposition, which says how many do not."""

from typing import NamedTuple

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.reference import by_reference

RANK_TOLERANCE = 1e-12
"""A row of C closer than this (relative, rows scaled to length one) to the span of the others is dependent.

Any value from 1e-15 to 1e-8 gives the same four-bar trajectories; 1e-6 and more drop a force that is really
there, because the 0/0 limit of (2.11) at a singularity is finite.
"""


@by_reference
class Workspace(NamedTuple):
    """Factors of one stage; every array is overwritten by the next call of `factor`."""

    mass: np.ndarray  # (2, n, n) the mass matrix that R belongs to, and the lower triangle R of Rᵀ
    C: np.ndarray  # (n, m) Cᵀ, whose columns are the rows of A R⁻¹ in use
    T: np.ndarray  # (m, n) rows of C, scaled and permuted: Householder vectors and the lower trapezoid T
    G: np.ndarray  # (2, m, m) Cholesky factor U of CCᵀ; columns of T as rows, then those of T = Q₂R₂
    tau: np.ndarray  # (4, m) Householder coefficients of T and of R₂, what rows of C were divided by, scratch
    order: np.ndarray  # (2, m) row of C that stands at each place of T; the rows of A in use, use[0] of them
    use: np.ndarray  # (2,) number of rows in use, and the largest rank that the constraints may have
    rank: np.ndarray  # (2,) rank of C, and which factors hold: 0 G[0], 1 T, 2 `Sparse`
    ratio: np.ndarray  # (1,) smallest pivot over largest, 1 without constraints


def workspace(n: int, m: int) -> Workspace:
    """Room for the factors of a system of n coordinates and m constraints."""
    return Workspace(
        np.full((2, n, n), np.nan),
        np.zeros((n, m)),
        np.zeros((m, n)),
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
    """Complete orthogonal decomposition of C into T and G[1]; sets rank and pivot ratio."""
    m, n, most = w.use[0], w.C.shape[0], w.use[1]
    T, G, tau, order = w.T, w.G[1], w.tau, w.order[0]
    longest = 0.0
    for i in range(m):
        for j in range(n):
            T[i, j] = w.C[j, i]
        tau[2, i] = np.sqrt(dot(T[i], T[i]))
        longest = max(longest, tau[2, i])
    for i in range(m):
        # A row that is noise beside the others must not be blown up to their size.
        if tau[2, i] <= RANK_TOLERANCE * longest:
            tau[2, i] = longest if longest > 0.0 else 1.0
        order[i] = i
        for j in range(n):
            T[i, j] /= tau[2, i]
    rank, first, last = 0, 0.0, 1.0
    for k in range(min(m, n, most)):
        best, largest = k, -1.0
        for i in range(k, m):
            square = dot(T[i, k:], T[i, k:])
            if square > largest:
                best, largest = i, square
        pivot = np.sqrt(largest)
        if k == 0:
            first = pivot
        if not pivot > RANK_TOLERANCE * first:
            break
        if best != k:
            for j in range(n):
                T[k, j], T[best, j] = T[best, j], T[k, j]
            order[k], order[best] = order[best], order[k]
        tau[0, k] = reflector(T[k, k:])
        for i in range(k + 1, m):
            reflect(T[k, k:], tau[0, k], T[i, k:])
        rank, last = k + 1, pivot
    if rank < m:
        for j in range(rank):
            for i in range(m):
                G[j, i] = T[i, j] if i >= j else 0.0
        for j in range(rank):
            tau[1, j] = reflector(G[j, j:m])
            for k in range(j + 1, rank):
                reflect(G[j, j:m], tau[1, j], G[k, j:m])
    w.rank[0], w.rank[1] = rank, 1
    w.ratio[0] = last / first if rank > 0 else 1.0
