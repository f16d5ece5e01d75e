"""The Cholesky factor R of M = RᵀR, and solves with it."""

import math

from biped.base.jit import kernel

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
