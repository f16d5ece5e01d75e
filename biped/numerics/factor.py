"""Factorisations of small matrices, in place and without a library call: triangular, and complete orthogonal ones.

A matrix B (k x n) is given by its rows, which are contiguous: Householder reflections with row pivoting turn them into
``P B H = [L 0]`` with H orthogonal (n x n), L (k x r) lower trapezoidal and P the pivoting; the rank r is where no
remaining row is longer than ``tolerance`` times the first pivot. Everything (3.7), (3.15) and (4.7) need of a
pseudo-inverse follows from it. Golub & Van Loan, Matrix Computations, 4th ed., section 5.4.

Rows that turn out independent are reflected all at once, a row in each lane of `biped.numerics.lanes`, with the
longest remaining row next; columns stand one under the other: C[j, i] is entry j of row i.
"""

import math

from biped.base.jit import kernel
from biped.numerics.lanes import (
    added,
    everywhere,
    few,
    largest,
    load,
    load_few,
    over,
    placed,
    plus,
    squared,
    store,
    times,
)


@kernel
def factor_lanes(C, kept, count, tolerance, pivot, V, tau):
    """Replaces C by C H, in the lanes that are no rows too.

    Args:
        C: (n, lanes); on return the first `count` numbers of a row are its row of L.
        kept: (1, lanes) 1 for rows, 0 for all else.
        count: Number of rows.
        tolerance: A row is dependent once its remainder is below this fraction of the longest row.
        pivot: (>= count,) integers: the lanes of the rows in the order of L.
        V: (>= count, >= n) the reflectors, V[i, j] for j > i; V[i, i] = 1 is not written.
        tau: (>= count,) their factors.

    Returns:
        Whether all rows are independent; if not, nothing of what was written is of use.
    """
    n = C.shape[0]
    s = everywhere(0.0)
    for j in range(n):
        s = squared(s, load(C, j))
    least, left = 0.0, load(kept, 0)
    for i in range(count):
        best, p = largest(times(s, left))
        if i == 0:
            least = tolerance * tolerance * best
        if not best > least:
            return False
        pivot[i] = p
        left = placed(left, p, 0.0)
        x = C[i, p]
        beta = -math.sqrt(best) if x > 0.0 else math.sqrt(best)
        tau[i] = (beta - x) / beta
        scale = 1.0 / (x - beta)
        s = load(C, i)
        for j in range(i + 1, n):
            V[i, j] = C[j, p] * scale
            s = added(s, V[i, j], load(C, j))
        along = times(everywhere(-tau[i]), s)
        store(C, i, plus(load(C, i), along))
        s = everywhere(0.0)
        for j in range(i + 1, n):
            x_j = added(load(C, j), V[i, j], along)
            store(C, j, x_j)
            s = squared(s, x_j)
    return True


@kernel
def reflect_few_back(V, tau, count, X):
    """Replaces the columns of X (n, 4) by H X."""
    for i in range(count - 1, -1, -1):
        s = load_few(X, i)
        for j in range(i + 1, X.shape[0]):
            s = added(s, V[i, j], load_few(X, j))
        s = times(few(-tau[i]), s)
        store(X, i, plus(load_few(X, i), s))
        for j in range(i + 1, X.shape[0]):
            store(X, j, added(load_few(X, j), V[i, j], s))


@kernel
def solve_few(C, pivot, count, D, X):
    """Writes the columns z of L z = d into the first `count` rows of X (n, 4), in the order of the pivots.

    Args:
        C: (n, lanes) of `factor_lanes`.
        pivot: (>= count,) likewise.
        count: Number of rows.
        D: (lanes, 4) right-hand sides d, by row of C.
        X: (>= count, 4).
    """
    for i in range(count):
        p = pivot[i]
        z = load_few(D, p)
        for k in range(i):
            z = added(z, -C[k, p], load_few(X, k))
        store(X, i, over(z, C[i, p]))


@kernel
def solve_lanes_transposed(C, pivot, count, z, x):
    """Writes x of Lᵀx = z (>= count,), in the order of the pivots, into the places (lanes,) of the rows; z is lost."""
    for i in range(count - 1, -1, -1):
        s = z[i]
        for k in range(i + 1, count):
            s -= C[i, pivot[k]] * x[pivot[k]]
        x[pivot[i]] = s / C[i, pivot[i]]


BLOCK = 8
"""Columns of a block of right-hand sides: a constant, so that columns go through vector registers."""


@kernel
def cholesky(M, R):
    """Writes the upper R of M = RᵀR from M's upper triangle, (n, n), with pivots floored at 1e-10 of the largest.

    The floor only matters to a perturbed, possibly indefinite controller model; it is far below any physical pivot.
    """
    n = M.shape[0]
    top = 0.0
    for i in range(n):
        top = max(top, M[i, i])
    floor = 1e-10 * top
    for i in range(n):
        s = M[i, i]
        for k in range(i):
            s -= R[k, i] * R[k, i]
        pivot = math.sqrt(max(s, floor))
        R[i, i] = pivot
        for j in range(i + 1, n):
            s = M[i, j]
            for k in range(i):
                s -= R[k, i] * R[k, j]
            R[i, j] = s / pivot


@kernel
def solve_transposed(R, x):
    """Replaces x (n,) by R⁻ᵀx."""
    for i in range(R.shape[0]):
        s = x[i]
        for k in range(i):
            s -= R[k, i] * x[k]
        x[i] = s / R[i, i]


@kernel
def solve_transposed_block(R, X):
    """Replaces the columns of X (n, BLOCK) by R⁻ᵀX."""
    n = R.shape[0]
    for i in range(n):
        inverse = 1.0 / R[i, i]
        for j in range(BLOCK):
            X[i, j] *= inverse
        for k in range(i + 1, n):
            for j in range(BLOCK):
                X[k, j] -= R[i, k] * X[i, j]


@kernel
def solve_upper(R, x):
    """Replaces x (n,) by R⁻¹x."""
    for i in range(R.shape[0] - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, R.shape[0]):
            s -= R[i, k] * x[k]
        x[i] = s / R[i, i]


@kernel
def weigh_rows(A, R, m, C):
    """Fills C = A R⁻¹ (m, n), the rows A (m, n) in the metric of M."""
    for i in range(m):
        for j in range(R.shape[0]):
            C[i, j] = A[i, j]
        solve_transposed(R, C[i])


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
