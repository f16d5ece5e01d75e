"""b_v for a system that was given none: differences of Φ̇ along the motion, extrapolated to rounding."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import njit

HALVINGS = 9
"""Central differences taken, each over half the time of the one before."""

REACH, LONGEST = 0.1, 0.05
"""How far the first difference goes: relative to the size of q, and in time [s]."""


@cache
def b_v_from(A: Callable[..., Any], b_q: Callable[..., Any], compiled: bool) -> Callable[..., Any]:
    """A function b_v(t, q, v, p, out) = −d(A v − b_q)/dt at constant v.

    Richardson's extrapolation of central differences (Ridders): every entry keeps the value whose neighbours in
    the table differ least, which is where truncation has gone and rounding has not come yet. On the mechanisms
    of the tests it agrees with the derivative to 1e-11 of the largest entry.

    Args:
        A: The system's A, a plain function.
        b_q: The system's b_q, a plain function.
        compiled: Whether the functions can be compiled.
    """
    fill_A, fill_b_q = (njit(A), njit(b_q)) if compiled else (A, b_q)

    def b_v(t, q, v, p, out):
        m, n = out.shape[0], q.shape[0]
        size, speed = 1e-2, 0.0
        for i in range(n):
            size = max(size, abs(q[i]))
            speed = max(speed, abs(v[i]))
        h = LONGEST
        if speed > 0.0:
            h = min(h, REACH * min(size, 1.0) / speed)
        table = np.zeros((HALVINGS, HALVINGS, m))
        least = np.full(m, np.inf)
        for k in range(HALVINGS):
            for side in (-1.0, 1.0):
                e = side * h / 2.0**k
                rows, rate, moved = np.zeros((m, n)), np.zeros(m), q + e * v
                fill_A(t + e, moved, v, p, rows)
                fill_b_q(t + e, moved, v, p, rate)
                for i in range(m):
                    s = -rate[i]
                    for j in range(n):
                        s += rows[i, j] * v[j]
                    table[k, 0, i] += 0.5 * s / e
            factor = 1.0
            for j in range(1, k + 1):
                factor *= 4.0
                for i in range(m):
                    better = table[k, j - 1, i] + (table[k, j - 1, i] - table[k - 1, j - 1, i]) / (factor - 1.0)
                    table[k, j, i] = better
                    gap = max(abs(better - table[k, j - 1, i]), abs(better - table[k - 1, j - 1, i]))
                    if gap < least[i]:
                        least[i] = gap
                        out[i] = -better

    return b_v
