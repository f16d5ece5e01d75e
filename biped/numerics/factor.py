"""A complete orthogonal decomposition of small matrices, in place and without a library call.

A matrix B (k x n) is given by its rows, which are contiguous: Householder reflections with row pivoting turn them into
``P B H = [L 0]`` with H orthogonal (n x n), L (k x r) lower trapezoidal and P the pivoting; the rank r is where no
remaining row is longer than ``tolerance`` times the first pivot. Everything (3.7), (3.15) and (4.7) need of a
pseudo-inverse follows from it. Golub & Van Loan, Matrix Computations, 4th ed., section 5.4.
"""

import math

from biped.base.jit import kernel
from biped.numerics.triangular import BLOCK


@kernel
def _reflect_rows(B, i, k, n, norm, tau):
    """Turns row i, whose columns from i on have this norm, onto column i, and rows i + 1 … k - 1 along with it."""
    x = B[i, i]
    beta = -norm if x > 0.0 else norm
    tau[i] = (beta - x) / beta
    scale = 1.0 / (x - beta)
    for c in range(i + 1, n):
        B[i, c] *= scale
    B[i, i] = beta
    for j in range(i + 1, k):
        s = B[j, i]
        for c in range(i + 1, n):
            s += B[i, c] * B[j, c]
        s *= tau[i]
        B[j, i] -= s
        for c in range(i + 1, n):
            B[j, c] -= s * B[i, c]


@kernel
def factor_rows(B, k, n, tolerance, tau, pivot):
    """Factors the first k rows of B, overwriting them with L and the reflectors.

    Args:
        B: Array (>= k, >= n); on return row i holds L[i, :min(i + 1, r)] and, in its columns i + 1 … n - 1, the tail
            of reflector i.
        k: Number of rows.
        n: Number of columns.
        tolerance: A row is dependent once its remainder is below this fraction of the longest row.
        tau: Array (>= k,), filled with the reflectors' factors.
        pivot: Integer array (>= k,), filled with the original number of each row.

    Returns:
        The rank r.
    """
    for i in range(k):
        pivot[i] = i
    longest = 0.0
    for i in range(min(k, n)):
        best = -1.0
        at = i
        for j in range(i, k):
            s = 0.0
            for c in range(i, n):
                s += B[j, c] * B[j, c]
            if s > best:
                best = s
                at = j
        if i == 0:
            longest = best
        if not best > tolerance * tolerance * longest:
            return i
        if at != i:
            pivot[i], pivot[at] = pivot[at], pivot[i]
            for c in range(n):
                B[i, c], B[at, c] = B[at, c], B[i, c]
        _reflect_rows(B, i, k, n, math.sqrt(best), tau)
    return min(k, n)


@kernel
def reflect(B, rank, n, tau, x):
    """Replaces x (n,) by Hᵀx, H being the product of the reflectors that `factor_rows` left in B."""
    for i in range(rank):
        s = x[i]
        for c in range(i + 1, n):
            s += B[i, c] * x[c]
        s *= tau[i]
        x[i] -= s
        for c in range(i + 1, n):
            x[c] -= s * B[i, c]


@kernel
def reflect_back(B, rank, n, tau, x):
    """Replaces x (n,) by Hx."""
    for i in range(rank - 1, -1, -1):
        s = x[i]
        for c in range(i + 1, n):
            s += B[i, c] * x[c]
        s *= tau[i]
        x[i] -= s
        for c in range(i + 1, n):
            x[c] -= s * B[i, c]


@kernel
def factor_tall(B, k, rank, L, tau):
    """Second factorisation when rows are dependent: the k x rank factor L = Z T, Z orthogonal, T upper triangular.

    L's transpose is written by rows into `L`, (rank, k), and factored there by unpivoted reflections.
    """
    for j in range(rank):
        for i in range(k):
            L[j, i] = B[i, j] if j <= i else 0.0
    for j in range(rank):
        s = 0.0
        for i in range(j, k):
            s += L[j, i] * L[j, i]
        _reflect_rows(L, j, rank, k, math.sqrt(s), tau)


@kernel
def least_squares(B, k, rank, pivot, L, tau2, d, z):
    """Minimises ‖L z - P d‖ over z (rank,) for the factors of `factor_rows`; z has room for k numbers."""
    for i in range(k):
        z[i] = d[pivot[i]]
    if rank == k:
        for i in range(k):
            s = z[i]
            for c in range(i):
                s -= B[i, c] * z[c]
            z[i] = s / B[i, i]
        return
    factor_tall(B, k, rank, L, tau2)
    reflect(L, rank, k, tau2, z)
    for j in range(rank - 1, -1, -1):
        s = z[j]
        for m in range(j + 1, rank):
            s -= L[m, j] * z[m]
        z[j] = s / L[j, j]


@kernel
def transposed_minimum_norm(B, k, rank, pivot, L, tau2, z, out):
    """Writes (Lᵀ)⁺ z, un-pivoted, into out (k,): the minimum-norm multipliers. `least_squares` must come first."""
    if rank == k:
        for i in range(k - 1, -1, -1):
            s = z[i]
            for j in range(i + 1, k):
                s -= B[j, i] * z[j]
            z[i] = s / B[i, i]
    else:
        for j in range(rank):
            s = z[j]
            for m in range(j):
                s -= L[j, m] * z[m]
            z[j] = s / L[j, j]
        for i in range(rank, k):
            z[i] = 0.0
        reflect_back(L, rank, k, tau2, z)
    for i in range(k):
        out[pivot[i]] = z[i]


@kernel
def minimum_norm(B, k, n, tolerance, tau, pivot, L, tau2, d, z, x):
    """Solves min ‖x‖ among the minimisers of ‖B x - d‖: x = B⁺ d.

    Args:
        B: Array (>= k, >= n), overwritten.
        k: Number of equations.
        n: Number of unknowns.
        tolerance: Relative rank tolerance.
        tau: Work (>= k,).
        pivot: Integer work (>= k,).
        L: Work (>= n, >= k).
        tau2: Work (>= n,).
        d: Right-hand side (>= k,).
        z: Work (>= max(k, n),).
        x: Result (n,).

    Returns:
        The rank of B.
    """
    rank = factor_rows(B, k, n, tolerance, tau, pivot)
    least_squares(B, k, rank, pivot, L, tau2, d, z)
    for i in range(n):
        x[i] = z[i] if i < rank else 0.0
    reflect_back(B, rank, n, tau, x)
    return rank


@kernel
def reflect_block(B, rank, tau, X, work):
    """Replaces the columns of X (n, BLOCK) by HᵀX, H being the product of the reflectors that `factor_rows` left in B.

    Args:
        B: (>= rank, n) factors.
        rank: Number of reflectors.
        tau: (>= rank,) their factors.
        X: (n, BLOCK) block.
        work: (BLOCK,).
    """
    for i in range(rank):
        for j in range(BLOCK):
            work[j] = X[i, j]
        for k in range(i + 1, X.shape[0]):
            for j in range(BLOCK):
                work[j] += B[i, k] * X[k, j]
        for j in range(BLOCK):
            work[j] *= tau[i]
            X[i, j] -= work[j]
        for k in range(i + 1, X.shape[0]):
            for j in range(BLOCK):
                X[k, j] -= B[i, k] * work[j]
