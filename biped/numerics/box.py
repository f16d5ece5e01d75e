"""Quadratic programs in a box, solved exactly: min ½ uᵀP u - rᵀu with lower <= u <= upper, P positive definite.

Unknowns are free or at a bound. First all that are on the wrong side change at once (Hintermüller, Ito & Kunisch, SIAM
J. Optim. 13, 2002): free ones whose minimum is beyond a bound go there, bounds with a multiplier of the wrong sign let
go. From the sets of a problem solved just before, that takes one to three steps; but it may go round in circles. Then
one changes at a time (Nocedal & Wright, Numerical Optimization, 2nd ed., algorithm 16.3, for bounds): the free ones go
towards their minimum until the first of them meets a bound, and at a minimum the worst bound lets go. Every such step
lowers the cost, so that ends.
"""

import math

from biped.base.jit import kernel

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
