"""Householder's reflections of a few independent rows, a row in each lane of `biped.numerics.lanes`.

With the longest remaining row next, C H = [L 0] row by row: H orthogonal, L lower triangular in the order of the
pivots. It is what `biped.numerics.factor` does row after row, all rows at once, for rows that turn out independent.
Columns stand one under the other: C[j, i] is entry j of row i.
"""

from __future__ import annotations

import math

from biped.base.jit import kernel
from biped.numerics.lanes import added, everywhere, load, plus, squared, store, times


@kernel
def factor_lanes(C, kept, count, tolerance, norm, pivot, V, tau):
    """Replaces C by C H, in the lanes that are no rows too.

    Args:
        C: (n, lanes); on return the first `count` numbers of a row are its row of L.
        kept: (1, lanes) 1 for rows, 0 for all else; overwritten with what is left of it.
        count: Number of rows.
        tolerance: A row is dependent once its remainder is below this fraction of the longest row.
        norm: (1, lanes) work.
        pivot: (>= count,) integers: the lanes of the rows in the order of L.
        V: (>= count, >= n) the reflectors, V[i, j] for j > i; V[i, i] = 1 is not written.
        tau: (>= count,) their factors.

    Returns:
        Whether all rows are independent; if not, nothing of what was written is of use.
    """
    n = C.shape[0]
    least = 0.0
    for i in range(count):
        s = everywhere(0.0)
        for j in range(i, n):
            s = squared(s, load(C, j))
        store(norm, 0, times(s, load(kept, 0)))
        best, p = -1.0, 0
        for lane in range(C.shape[1]):
            better = norm[0, lane] > best
            best = norm[0, lane] if better else best
            p = lane if better else p
        if i == 0:
            least = tolerance * tolerance * best
        if not best > least:
            return False
        pivot[i] = p
        kept[0, p] = 0.0
        x = C[i, p]
        beta = -math.sqrt(best) if x > 0.0 else math.sqrt(best)
        tau[i] = (beta - x) / beta
        scale = 1.0 / (x - beta)
        s = load(C, i)
        for j in range(i + 1, n):
            V[i, j] = C[j, p] * scale
            s = added(s, V[i, j], load(C, j))
        s = times(everywhere(-tau[i]), s)
        store(C, i, plus(load(C, i), s))
        for j in range(i + 1, n):
            store(C, j, added(load(C, j), V[i, j], s))
    return True


@kernel
def reflect_lanes_back(V, tau, count, X):
    """Replaces the columns of X (n, lanes) by H X."""
    for i in range(count - 1, -1, -1):
        s = load(X, i)
        for j in range(i + 1, X.shape[0]):
            s = added(s, V[i, j], load(X, j))
        s = times(everywhere(-tau[i]), s)
        store(X, i, plus(load(X, i), s))
        for j in range(i + 1, X.shape[0]):
            store(X, j, added(load(X, j), V[i, j], s))


@kernel
def solve_lanes(C, pivot, count, d, row, X, column):
    """Writes z of L z = d into a column of X, in the order of the pivots.

    Args:
        C: (n, lanes) of `factor_lanes`.
        pivot: (>= count,) likewise.
        count: Number of rows.
        d: (k, lanes) right-hand sides by row of C; one is overwritten.
        row: Which.
        X: (>= count, lanes).
        column: Which.
    """
    for i in range(count):
        z = d[row, pivot[i]] / C[i, pivot[i]]
        X[i, column] = z
        store(d, row, added(load(d, row), -z, load(C, i)))


@kernel
def solve_lanes_transposed(C, pivot, count, z, x):
    """Writes x of Lᵀx = z (>= count,), in the order of the pivots, into the places (lanes,) of the rows; z is lost."""
    for i in range(count - 1, -1, -1):
        s = z[i]
        for k in range(i + 1, count):
            s -= C[i, pivot[k]] * x[pivot[k]]
        x[pivot[i]] = s / C[i, pivot[i]]
