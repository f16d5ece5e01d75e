"""Which joint torques stand at their limits, found one change at a time.

A law's nearest torques minimise a strictly convex cost within |u| <= limit. Its ground forces are unknowns too, so that
a box solver cannot take the problem as it is: whoever knows the forces minimises with some torques held at their limits
(`side`), and this module says which torque changes its side. First the one that is furthest on the wrong side, free or
held: from the sides of the tick before, that takes one or two changes. It may go in circles, seen in one of 300,000
ticks of a walk in space, where ties among ground forces were broken differently with and without a torque. Then torques
go down the cost as an active set does (Nocedal & Wright, Numerical Optimization, 2nd ed., algorithm 16.3): towards the
minimum of the free ones until one meets its limit, and at the minimum the one that its limit holds back most lets go.
Every such change lowers the cost, so that ends.
"""

from biped.base.jit import inner_kernel, kernel

MOST_CHANGES = 60
"""Changes after which the problem is given up; random problems of six torques take 23 at most."""
WORST_FIRST = 12
"""Changes of the torque that is furthest on the wrong side."""
_SLACK, _ROUNDING = 1e-9, 1e-6
"""[N m] Distances from a limit that do not count; and in a descent, where rounding of that size was seen."""


@inner_kernel
def coordinate(j, above, below):
    """The number of a driven joint's coordinate; the base's stand behind those of the joints above the legs."""
    return j if j < above else j + below


@kernel
def change_limits(turn, x, above, below, regularisation, limit, side, u):
    """Moves a torque to or from its limit; returns whether one was on the wrong side.

    Args:
        turn: How many changes came before in this tick.
        x: P (M q̈_d + h - Gᵀc) by coordinate, for the sides as they are: ε times the torques that minimise the cost
            where free; held ones would go towards theirs.
        above: Number of driven joints whose coordinates come before the base's.
        below: What is added to the number of every other joint for its coordinate.
        regularisation: ε [1/(kg m²)].
        limit: (nu,) [N m].
        side: (nu,) -1 and 1: held at the lower and upper limit, 0: free. Live.
        u: (nu,) torques [N m] of the sides as they were found; while they go down the cost, none beyond its limit.
    """
    if turn >= WORST_FIRST:
        if turn == WORST_FIRST:
            for j in range(u.size):
                u[j] = min(max(u[j], -limit[j]), limit[j])
        if _met_limit(x, above, below, regularisation, limit, side, u):
            return True
    worst, which, to = (_ROUNDING if turn >= WORST_FIRST else _SLACK), -1, 0
    for j in range(u.size):
        wanted = x[coordinate(j, above, below)] / regularisation
        if side[j] == 0:
            u[j] = wanted
            beyond, way = abs(wanted) - limit[j], (1 if wanted > 0.0 else -1)
        else:
            u[j] = side[j] * limit[j]
            beyond, way = limit[j] - side[j] * wanted, 0
        if beyond > worst:
            worst, which, to = beyond, j, way
    if which >= 0:
        side[which] = to
    return which >= 0


@kernel
def _met_limit(x, above, below, regularisation, limit, side, u):
    """Moves the free u towards the minimum as far as a limit, which is then kept; returns whether there is one."""
    part, met, way = 1.0, -1, 0
    for j in range(u.size):
        wanted = x[coordinate(j, above, below)] / regularisation
        if side[j] == 0 and abs(wanted) > limit[j] + _ROUNDING:
            to = 1 if wanted > 0.0 else -1
            share = (to * limit[j] - u[j]) / (wanted - u[j])
            if met < 0 or share < part:
                part, met, way = share, j, to
    if met < 0:
        return False
    for j in range(u.size):
        if side[j] == 0:
            u[j] += part * (x[coordinate(j, above, below)] / regularisation - u[j])
    side[met] = way
    u[met] = way * limit[met]
    return True
