"""Householder's reflections of a few independent rows, a row in each lane of `biped.numerics.lanes`.

With the longest remaining row next, C H = [L 0] row by row: H orthogonal, L lower triangular in the order of the
pivots. It is what `biped.numerics.factor` does row after row, all rows at once, for rows that turn out independent.
Columns stand one under the other: C[j, i] is entry j of row i.
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
