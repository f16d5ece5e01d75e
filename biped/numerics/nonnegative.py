"""Convex quadratic problems in a few non-negative unknowns, exactly: min ½ xᵀHx - fᵀx with x >= 0.

Block principal pivoting (Júdice and Pires, Computers & Operations Research 21, 1994): all infeasible unknowns change
sides at once; when that stops helping, one at a time, which ends for every positive definite H (Murty, 1974). A set of
free unknowns that was right in the last problem usually is in the next one, which then costs one factorisation.
"""

from __future__ import annotations

import math

from biped.base.jit import kernel

MOST = 200
"""Changes of the free set after which the problem is given up (never seen beyond 30)."""
_PATIENCE = 3


@kernel
def nonnegative(H, f, n, free, L, x, y):
    """Solves min ½ xᵀHx - fᵀx, x >= 0.

    Args:
        H: (>= n, >= n) symmetric positive definite; the lower triangle is read.
        f: (>= n,).
        n: Number of unknowns.
        free: (>= n,) 0 or 1: the unknowns believed to be positive, and on return those that may be.
        L: (>= n, >= n) work.
        x: (>= n,) result.
        y: (>= n,) its multipliers H x - f, zero where free, else non-negative.

    Returns:
        How often the free set changed; MOST if no solution was found.
    """
    fewest = n + 1
    patience = _PATIENCE
    top = 0.0
    for i in range(n):
        top = max(top, abs(f[i]))
    tiny = 1e-13 * top
    for turn in range(MOST):
        _solve_free(H, f, n, free, L, x)
        wrong, last = 0, -1
        for i in range(n):
            if free[i]:
                y[i] = 0.0
                if x[i] < 0.0:
                    wrong += 1
                    last = i
            else:
                s = -f[i]
                for j in range(n):
                    if free[j]:
                        s += (H[i, j] if j <= i else H[j, i]) * x[j]
                y[i] = s
                if s < -tiny:
                    wrong += 1
                    last = i
        if wrong == 0:
            return turn
        if wrong < fewest:
            fewest = wrong
            patience = _PATIENCE
        elif patience > 0:
            patience -= 1
        else:
            free[last] = 1 - free[last]
            continue
        for i in range(n):
            if (free[i] and x[i] < 0.0) or (free[i] == 0 and y[i] < -tiny):
                free[i] = 1 - free[i]
    return MOST


@kernel
def _solve_free(H, f, n, free, L, x):
    """Fills x with the solution of H x = f among the free unknowns, zero elsewhere."""
    for i in range(n):
        if free[i] == 0:
            x[i] = 0.0
            continue
        s = f[i]
        for j in range(i):
            if free[j] == 0:
                continue
            t = H[i, j]
            for k in range(j):
                if free[k]:
                    t -= L[i, k] * L[j, k]
            t /= L[j, j]
            L[i, j] = t
            s -= t * x[j]
        p = H[i, i]
        for k in range(i):
            if free[k]:
                p -= L[i, k] * L[i, k]
        L[i, i] = math.sqrt(max(p, 1e-14 * H[i, i]))
        x[i] = s / L[i, i]
    for i in range(n - 1, -1, -1):
        if free[i] == 0:
            continue
        s = x[i]
        for k in range(i + 1, n):
            if free[k]:
                s -= L[k, i] * x[k]
        x[i] = s / L[i, i]
