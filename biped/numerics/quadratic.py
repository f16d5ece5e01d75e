"""Convex quadratic problems of a few unknowns, solved exactly: non-negative ones, and ones in a box.

Non-negative unknowns, min ½ xᵀHx - fᵀx with x >= 0: the active set of Lawson and Hanson (Solving Least Squares
Problems, 1974, chapter 23), begun with a set of unknowns that is believed to be free: those that the solution wants
negative leave it, and then the unknown with the worst multiplier enters, one at a time. Every step lowers the cost, so
that no set comes twice, however many unknowns share what few could do. A set that was right in the last problem usually
is in the next one, which then costs one factorisation.

Unknowns in a box, min ½ uᵀP u - rᵀu with lower <= u <= upper, P positive definite, are free or at a bound. First all
that are on the wrong side change at once (Hintermüller, Ito & Kunisch, SIAM J. Optim. 13, 2002): free ones whose
minimum is beyond a bound go there, bounds with a multiplier of the wrong sign let go. From the sets of a problem solved
just before, that takes one to three steps; but it may go round in circles. Then one changes at a time (Nocedal &
Wright, Numerical Optimization, 2nd ed., algorithm 16.3, for bounds): the free ones go towards their minimum until the
first of them meets a bound, and at a minimum the worst bound lets go. Every such step lowers the cost, so that ends.
"""

import math

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


TOGETHER = 6
"""Steps in which all change at once."""
MOST_STEPS = 60
"""Most steps; six unknowns take a handful."""
SIGN = 1e-14
"""Size of a multiplier, relative to the numbers that it is the difference of, whose sign is rounding."""


@kernel
def solve_in_box(P, r, lower, upper, side, u, L, x):
    """Solves the problem from the sets in `side`.

    Args:
        P: (n, n), symmetric, both triangles.
        r: (n,).
        lower: (n,) bounds.
        upper: (n,) bounds, above the lower.
        side: (n,) integers, -1 and 1: at the lower and upper bound, 0: free; where to start, overwritten by where the
            solution is.
        u: (n,) where free unknowns start, clipped; overwritten by the solution.
        L: Work (n, n).
        x: Work (n,).

    Returns:
        The number of steps; MOST_STEPS if it has not ended, with the best u so far.
    """
    for step in range(TOGETHER):
        _to_bounds(lower, upper, side, u)
        _minimise_free(P, r, side, u, L, x)
        if not _change_all(P, r, lower, upper, side, x):
            for i in range(r.size):
                u[i] = x[i]
            return step + 1
    _to_bounds(lower, upper, side, u)
    for step in range(TOGETHER, MOST_STEPS):
        _minimise_free(P, r, side, u, L, x)
        if _advance_free(lower, upper, side, u, x):
            continue
        if not _let_go(P, r, side, u):
            return step + 1
    return MOST_STEPS


@kernel
def _to_bounds(lower, upper, side, u):
    """Puts unknowns at the bounds that they are to be at, and the free ones between them."""
    for i in range(u.size):
        if side[i] != 0:
            u[i] = lower[i] if side[i] < 0 else upper[i]
        else:
            u[i] = min(max(u[i], lower[i]), upper[i])


@kernel
def _minimise_free(P, r, side, u, L, x):
    """Writes the free unknowns' minimum, the others where they are, into x: by Cholesky, LLᵀ of the free part of P."""
    n = r.size
    for i in range(n):
        if side[i] != 0:
            continue
        s = r[i]
        for j in range(n):
            if side[j] != 0:
                s -= P[i, j] * u[j]
        for j in range(i):
            if side[j] != 0:
                continue
            t = P[i, j]
            for k in range(j):
                if side[k] == 0:
                    t -= L[i, k] * L[j, k]
            L[i, j] = t / L[j, j]
            s -= L[i, j] * x[j]
        t = P[i, i]
        for k in range(i):
            if side[k] == 0:
                t -= L[i, k] * L[i, k]
        L[i, i] = math.sqrt(t)
        x[i] = s / L[i, i]
    for i in range(n - 1, -1, -1):
        if side[i] != 0:
            x[i] = u[i]
            continue
        s = x[i]
        for k in range(i + 1, n):
            if side[k] == 0:
                s -= L[k, i] * x[k]
        x[i] = s / L[i, i]


@kernel
def _advance_free(lower, upper, side, u, x):
    """Moves u to x, or as far as the first bound, which is then kept; returns whether there was one."""
    n = u.size
    part, met = 1.0, -1
    for i in range(n):
        if side[i] == 0 and not lower[i] <= x[i] <= upper[i]:
            bound = lower[i] if x[i] < lower[i] else upper[i]
            share = (bound - u[i]) / (x[i] - u[i])
            if met < 0 or share < part:
                part, met = share, i
    if met < 0:
        for i in range(n):
            u[i] = x[i]
        return False
    for i in range(n):
        if side[i] == 0:
            u[i] = min(max(u[i] + part * (x[i] - u[i]), lower[i]), upper[i])
    side[met] = -1 if x[met] < lower[met] else 1
    u[met] = lower[met] if side[met] < 0 else upper[met]
    return True


@kernel
def _pull(P, r, u, i):
    """The cost's gradient in u[i]; 0 where its sign is rounding."""
    gradient, size = -r[i], abs(r[i])
    for j in range(u.size):
        term = P[i, j] * u[j]
        gradient += term
        size += abs(term)
    return gradient if abs(gradient) > SIGN * size else 0.0


@kernel
def _change_all(P, r, lower, upper, side, x):
    """Changes the side of all unknowns that are on the wrong one at x; returns whether there are any."""
    changed = False
    for i in range(x.size):
        if side[i] != 0:
            if side[i] * _pull(P, r, x, i) > 0.0:
                side[i] = 0
                changed = True
        elif not lower[i] <= x[i] <= upper[i]:
            side[i] = -1 if x[i] < lower[i] else 1
            changed = True
    return changed


@kernel
def _let_go(P, r, side, u):
    """Frees the unknown whose bound holds it against the cost's gradient most; returns whether there is one."""
    worst, which = 0.0, -1
    for i in range(u.size):
        held = side[i] * _pull(P, r, u, i)
        if held > worst:
            worst, which = held, i
    if which < 0:
        return False
    side[which] = 0
    return True
