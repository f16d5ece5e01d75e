"""Convex quadratic problems in a few non-negative unknowns, exactly: min ½ xᵀHx - fᵀx with x >= 0.

The active set of Lawson and Hanson (Solving Least Squares Problems, 1974, chapter 23), begun with a set of unknowns
that is believed to be free: those that the solution wants negative leave it, and then the unknown with the worst
multiplier enters, one at a time. Every step lowers the cost, so that no set comes twice, however many unknowns share
what few could do. A set that was right in the last problem usually is in the next one, which then costs one
factorisation.
"""

from biped.base.jit import inner_kernel, kernel
from biped.numerics.lanes import LANES, added, load, store

MOST = 200
"""Changes of the free set after which the problem is given up: only where rounding decides (never seen beyond 45)."""


@kernel
def nonnegative(H, f, n, free, order, U, L, x, y):
    """Solves min ½ xᵀHx - fᵀx, x >= 0. Vectors are rows of `biped.numerics.lanes`, of which the first n numbers count.

    Args:
        H: (>= n, lanes) symmetric positive definite, both triangles; lanes is a multiple of `LANES`.
        f: (1, lanes).
        n: Number of unknowns.
        free: (>= n,) 0 or 1: the unknowns believed to be positive, and on return those that may be.
        order: (>= n,) integers, work.
        U: (>= n, lanes) work.
        L: (>= n, >= n) work.
        x: (1, lanes) result.
        y: (1, lanes) its multipliers H x - f, zero where free, else non-negative.

    Returns:
        How often the free set changed; MOST if no solution was found.
    """
    top = 0.0
    for i in range(n):
        y[0, i] = 0.0
        top = max(top, abs(f[0, i]))
    tiny = 1e-13 * top
    for turn in range(MOST):
        m = _solve_free(H, f, n, free, order, U, L, x)
        if _leave(m, free, order, x, y):
            continue
        _multipliers(H, f, n, m, free, order, x, y)
        worst, enters = 0.0, -1
        for i in range(n):
            if y[0, i] < -tiny and y[0, i] * y[0, i] > worst * H[i, i]:
                worst, enters = y[0, i] * y[0, i] / H[i, i], i
        if enters < 0:
            return turn
        free[enters] = 1
        for i in range(n):
            y[0, i] = x[0, i]
    return MOST


@inner_kernel
def _leave(m, free, order, x, y):
    """Goes from the feasible y towards x as far as no unknown is negative; who stops it is no longer free.

    Returns:
        Whether one did.
    """
    most, first = 1.0, -1
    for a in range(m):
        i = order[a]
        if x[0, i] < 0.0:
            part = y[0, i] / (y[0, i] - x[0, i])
            if first < 0 or part < most:
                most, first = part, i
    if first < 0:
        return False
    for a in range(m):
        i = order[a]
        falls = x[0, i] < 0.0
        y[0, i] += most * (x[0, i] - y[0, i])
        if i == first or (falls and y[0, i] <= 0.0):
            free[i] = 0
            y[0, i] = 0.0
    return True


@inner_kernel
def _multipliers(H, f, n, m, free, order, x, y):
    """Fills y with H x - f, and zero where free; of the m free ones `order` tells which they are."""
    blocks = f.shape[1] // LANES
    for block in range((n + LANES - 1) // LANES):
        s = load(f, block)
        for a in range(m):
            j = order[a]
            s = added(s, -x[0, j], load(H, blocks * j + block))
        store(y, block, s)
    for i in range(n):
        y[0, i] = 0.0 if free[i] else -y[0, i]


@inner_kernel
def _solve_free(H, f, n, free, order, U, L, x):
    """Fills x with the solution of H x = f among the free unknowns, zero elsewhere; returns how many they are.

    The free part of H is L D Lᵀ: rows of D Lᵀ stand in U, in the lanes that they have in H; of the work space L the
    diagonal holds D⁻¹.
    """
    blocks = f.shape[1] // LANES
    m = 0
    for i in range(n):
        x[0, i] = 0.0
        if free[i]:
            order[m] = i
            m += 1
    for a in range(m):
        i = order[a]
        s = f[0, i]
        for k in range(a):
            L[a, k] = U[k, i] * L[k, k]
            s -= L[a, k] * x[0, order[k]]
        x[0, i] = s
        for block in range(i // LANES, (n + LANES - 1) // LANES):  # lanes before its own nobody asks for
            u = load(H, blocks * i + block)
            for k in range(a):
                u = added(u, -L[a, k], load(U, blocks * k + block))
            store(U, blocks * a + block, u)
        L[a, a] = 1.0 / max(U[a, i], 1e-14 * H[i, i])
    for a in range(m - 1, -1, -1):
        s = x[0, order[a]] * L[a, a]
        for k in range(a + 1, m):
            s -= L[k, a] * x[0, order[k]]
        x[0, order[a]] = s
    return m
