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
    """Where K is not zero and what its factors are; N = n + m places, none for a mechanism treated as full.

    What arrays are indexed by has no sign: of a number that might be negative every use would be checked.
    """

    M: np.ndarray  # (·, 3) places (i, j) of M that are filled, and where each goes in `values`: above the diagonal last
    A: np.ndarray  # (·, 3) places (i, j) of A that are filled, and where each goes in `values`
    place: np.ndarray  # (N,) of each node in the order of elimination
    start: np.ndarray  # (N + 1,) first entry of each column of L
    row: np.ndarray  # (·,) place of each entry of L
    target: np.ndarray  # (·,) where in `values` each product of two entries of a column goes
    values: np.ndarray  # (N + · + 1,) D, then the columns of L, then what is above the diagonal of M
    x: np.ndarray  # (2, N, 2) two solutions and their residuals
    size: np.ndarray  # (N,) sum of the magnitudes that a pivot was made of
    use: np.ndarray  # (N,) by node: 1 a coordinate, −1 a constraint in use, 0 one that is not


def dense() -> Sparse:
    """Nothing known about zeros."""
    at, places, none = np.zeros((0, 3), np.uint64), np.zeros(0, np.uint64), np.zeros(0)
    return Sparse(at, at, places, np.zeros(0, np.int64), places, places, none, np.zeros((2, 0, 2)), none, none)


@kernel
def activate(rows, count, K):
    """Put the first `count` of the rows of A in use, and no others."""
    use = K.use
    n = use.shape[0] - rows.shape[0]
    for i in range(rows.shape[0]):
        use[n + rows[i]] = -1.0 if i < count else 0.0


@kernel
def fill(M, A, K):
    """Write K into `values`, and the sign that each pivot should have into x[1, :, 0]."""
    n, N = M.shape[0], K.use.shape[0]
    values, size, use, signs, place, in_M, in_A = K.values, K.size, K.use, K.x[1], K.place, K.M, K.A
    rows = use[n:]
    for e in range(values.shape[0]):
        values[e] = 0.0
    for e in range(in_M.shape[0]):
        values[in_M[e, 2]] = M[in_M[e, 0], in_M[e, 1]]
    for e in range(in_A.shape[0]):
        if rows[in_A[e, 0]] != 0.0:
            values[in_A[e, 2]] = A[in_A[e, 0], in_A[e, 1]]
    for k in range(N):
        size[k] = abs(values[k])
    for i in range(N):
        signs[place[i], 0] = use[i]
        if use[i] == 0.0:
            values[place[i]] = -1.0
            size[place[i]] = 1.0


@kernel
def factor_sparse(M, A, K):
    """Factor K with the rows of A in use; return the smallest pivot ratio, 0 if a pivot has the wrong sign."""
    N = K.use.shape[0]
    values, size, signs, start, row, target = K.values, K.size, K.x[1], K.start, K.row, K.target
    fill(M, A, K)
    least, t = 1.0, 0
    for k in range(N):
        pivot = values[k]
        share = abs(pivot) / size[k]
        # A constraint's diagonal is made of squares with a minus: its pivot is negative, a coordinate's positive.
        if not (share > 1e-14) or (pivot > 0.0) != (signs[k, 0] > 0.0):
            return 0.0
        if pivot < 0.0:
            least = min(least, share)
        first, last = N + start[k], N + start[k + 1]
        inverse = 1.0 / pivot
        for a in range(first, last):
            l = values[a] * inverse
            term = l * values[a]
            i = row[a - N]
            values[i] -= term
            size[i] += abs(term)
            for b in range(first, a):
                values[target[t]] -= l * values[b]
                t += 1
        for a in range(first, last):
            values[a] *= inverse
    return np.sqrt(least)


@kernel
def substitute(x, K):
    """Overwrite both columns of x (N, 2), in the order of elimination, with K⁻¹x: two cost hardly more than one."""
    N = x.shape[0]
    values, start, row = K.values, K.start, K.row
    for k in range(N):
        one, two = x[k, 0], x[k, 1]
        for a in range(start[k], start[k + 1]):
            i, l = row[a], values[N + a]
            x[i, 0] -= l * one
            x[i, 1] -= l * two
    for k in range(N - 1, -1, -1):
        one, two = x[k, 0] / values[k], x[k, 1] / values[k]
        for a in range(start[k], start[k + 1]):
            i, l = row[a], values[N + a]
            one -= l * x[i, 0]
            two -= l * x[i, 1]
        x[k, 0], x[k, 1] = one, two


@kernel
def load(top, first, second, K, x):
    """Write the right-hand sides (top (n,), first (m,)) and (0, second (m,)) into x (N, 2); an empty one is zero."""
    n = x.shape[0] - second.shape[0]
    place, use = K.place, K.use
    for k in range(x.shape[0]):
        x[k, 0] = x[k, 1] = 0.0
    for i in range(top.shape[0]):
        x[place[i], 0] = top[i]
    for i in range(first.shape[0]):
        if use[n + i] != 0.0:
            x[place[n + i], 0] = first[i]
    for i in range(second.shape[0]):
        if use[n + i] != 0.0:
            x[place[n + i], 1] = second[i]


@kernel
def refine(M, A, K):
    """Improve both solutions in x[0] by their residuals, which x[1] (N, 2) holds as far as the right-hand sides."""
    x, r, place, in_M, in_A = K.x[0], K.x[1], K.place, K.M, K.A
    n = M.shape[0]
    nodes, rows = place[n:], K.use[n:]
    for e in range(in_M.shape[0]):
        value, i, j = M[in_M[e, 0], in_M[e, 1]], place[in_M[e, 0]], place[in_M[e, 1]]
        for c in range(2):
            r[i, c] -= value * x[j, c]
    for e in range(in_A.shape[0]):
        if rows[in_A[e, 0]] != 0.0:
            value, i, j = A[in_A[e, 0], in_A[e, 1]], nodes[in_A[e, 0]], place[in_A[e, 1]]
            for c in range(2):
                r[i, c] -= value * x[j, c]
                r[j, c] -= value * x[i, c]
    substitute(r, K)
    for k in range(x.shape[0]):
        for c in range(2):
            x[k, c] += r[k, c]


@kernel
def take(c, K, out):
    """Out = the coordinates of one of the two solutions."""
    x, place = K.x[0], K.place
    for i in range(out.shape[0]):
        out[i] = x[place[i], c]


@kernel
def solve_sparse(M, A, top, first, second, ratio, K, out, other):
    """Out = the x (n,) of M x + Aᵀμ = top, A x = first, and other = that of M x + Aᵀμ = 0, A x = second.

    The first μ is left in K.x[0, :, 0]. What is not wanted is left empty, `top` and `first` too where they are zero.
    Solutions are refined where the pivot ratio of the factors calls for it.
    """
    load(top, first, second, K, K.x[0])
    substitute(K.x[0], K)
    if ratio < REFINED:
        load(top, first, second, K, K.x[1])
        refine(M, A, K)
    take(0, K, out)
    take(1, K, other)


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
