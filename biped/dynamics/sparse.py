"""Large mechanisms: the linear algebra of one stage where M and A have few entries that are not zero.

The whole of

    K = [ M  Aᵀ ]
        [ A  0  ]

is factored as LDLᵀ in an order found once (`pattern.py`): every constraint comes after all of its coordinates,
so pivots keep their signs, positive for a coordinate and negative for a constraint, and nothing is exchanged on
the way. A chain or a tree costs a fixed number of operations a body.
"""

from typing import NamedTuple

import numpy as np

from biped.base.jit import kernel
from biped.dynamics.reference import by_reference

REFINED = 1e-2
"""Pivot ratio below which a solution is refined: the factors alone lose as many digits as its square has."""

SPARSE_RATIO = 1e-6
"""Smallest pivot ratio at which the factors are trusted: refined, they are still exact."""


@by_reference
class Sparse(NamedTuple):
    """Where K is not zero and what its factors are; N = n + m places, none for a mechanism treated as full."""

    M: np.ndarray  # (·, 3) places (i, j) of M that are filled, and where each goes in `values`; −1 above the diagonal
    A: np.ndarray  # (·, 3) places (i, j) of A that are filled, and where each goes in `values`
    index: np.ndarray  # place of each node, first entry of each column of L, place of each entry, `target`
    values: np.ndarray  # (N + ·,) D, then the columns of L
    x: np.ndarray  # (2, N) a solution and its residual
    size: np.ndarray  # (N,) sum of the magnitudes that a pivot was made of
    use: np.ndarray  # (N,) by node: 1 a coordinate, −1 a constraint in use, 0 one that is not


def dense() -> Sparse:
    """Nothing known about zeros."""
    at, none = np.zeros((0, 3), np.int64), np.zeros(0)
    return Sparse(at, at, np.zeros(0, np.int64), none, np.zeros((2, 0)), none, none)


@kernel
def activate(rows, count, K):
    """Put the first `count` of the rows of A in use, and no others."""
    use = K.use
    n = use.shape[0] - rows.shape[0]
    for i in range(rows.shape[0]):
        use[n + rows[i]] = -1.0 if i < count else 0.0


@kernel
def factor_sparse(M, A, K):
    """Factor K with the rows of A in use; return the smallest pivot ratio, 0 if a pivot has the wrong sign."""
    n, N = M.shape[0], K.use.shape[0]
    values, size, use, signs, in_M, in_A = K.values, K.size, K.use, K.x[1], K.M, K.A
    place, start = K.index[:N], K.index[N : 2 * N + 1]
    row, target = K.index[2 * N + 1 : N + 1 + values.shape[0]], K.index[N + 1 + values.shape[0] :]
    for e in range(values.shape[0]):
        values[e] = 0.0
    for e in range(in_M.shape[0]):
        if in_M[e, 2] >= 0:
            values[in_M[e, 2]] = M[in_M[e, 0], in_M[e, 1]]
    for e in range(in_A.shape[0]):
        if use[n + in_A[e, 0]] != 0.0:
            values[in_A[e, 2]] = A[in_A[e, 0], in_A[e, 1]]
    for k in range(N):
        size[k] = abs(values[k])
    for i in range(N):
        signs[place[i]] = use[i]
        if use[i] == 0.0:
            values[place[i]] = -1.0
            size[place[i]] = 1.0
    least, t = 1.0, 0
    for k in range(N):
        pivot = values[k]
        share = abs(pivot) / size[k]
        # A constraint's diagonal is made of squares with a minus: its pivot is negative, a coordinate's positive.
        if not (share > 1e-14) or (pivot > 0.0) != (signs[k] > 0.0):
            return 0.0
        if pivot < 0.0:
            least = min(least, share)
        first, last = N + start[k], N + start[k + 1]
        for a in range(first, last):
            l = values[a] / pivot
            term = l * values[a]
            i = row[a - N]
            values[i] -= term
            size[i] += abs(term)
            for b in range(first, a):
                values[target[t]] -= l * values[b]
                t += 1
        for a in range(first, last):
            values[a] /= pivot
    return np.sqrt(least)


@kernel
def substitute(x, K):
    """Overwrite x (N,), in the order of elimination, with K⁻¹x."""
    N = x.shape[0]
    values, start, row = K.values, K.index[N : 2 * N + 1], K.index[2 * N + 1 :]
    for k in range(N):
        for a in range(start[k], start[k + 1]):
            x[row[a]] -= values[N + a] * x[k]
    for k in range(N - 1, -1, -1):
        s = x[k] / values[k]
        for a in range(start[k], start[k + 1]):
            s -= values[N + a] * x[row[a]]
        x[k] = s


@kernel
def load(top, bottom, K, x):
    """Write the right-hand side (top (n,), bottom (m,) of the rows in use) into x (N,)."""
    n = top.shape[0]
    index, use = K.index, K.use
    for i in range(n):
        x[index[i]] = top[i]
    for i in range(bottom.shape[0]):
        x[index[n + i]] = bottom[i] if use[n + i] != 0.0 else 0.0


@kernel
def solve_sparse(M, A, top, bottom, ratio, K, out):
    """Out = the x (n,) of M x + Aᵀμ = top, A x = bottom; `out` may be `top`. μ is left in K.x[0].

    The solution is refined where the pivot ratio of the factors calls for it.
    """
    n = top.shape[0]
    x, r, index, use, in_M, in_A = K.x[0], K.x[1], K.index, K.use, K.M, K.A
    load(top, bottom, K, x)
    substitute(x, K)
    if ratio < REFINED:
        load(top, bottom, K, r)
        for e in range(in_M.shape[0]):
            i, j = in_M[e, 0], in_M[e, 1]
            r[index[i]] -= M[i, j] * x[index[j]]
        for e in range(in_A.shape[0]):
            if use[n + in_A[e, 0]] != 0.0:
                value = A[in_A[e, 0], in_A[e, 1]]
                i, j = index[n + in_A[e, 0]], index[in_A[e, 1]]
                r[i] -= value * x[j]
                r[j] -= value * x[i]
        substitute(r, K)
        for k in range(x.shape[0]):
            x[k] += r[k]
    for i in range(n):
        out[i] = x[index[i]]


@kernel
def clear(X, at):
    """Write zeros where X may be filled."""
    for e in range(at.shape[0]):
        X[at[e, 0], at[e, 1]] = 0.0


@kernel
def row_products(A, x, at, out):
    """Out = A x over the entries that may be filled."""
    for i in range(out.shape[0]):
        out[i] = 0.0
    for e in range(at.shape[0]):
        out[at[e, 0]] += A[at[e, 0], at[e, 1]] * x[at[e, 1]]


@kernel
def spilled(X, at):
    """Whether X has an entry that is not zero where none was expected."""
    count = 0
    for i in range(X.shape[0]):
        for j in range(X.shape[1]):
            count += X[i, j] != 0.0
    for e in range(at.shape[0]):
        count -= X[at[e, 0], at[e, 1]] != 0.0
    return count != 0
