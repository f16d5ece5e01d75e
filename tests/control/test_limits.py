"""Torques at their limits, found one at a time: the minimum of a box, also where the worst-first rule circles."""

from __future__ import annotations

import numpy as np
import pytest

from biped.control import limits
from biped.control.limits import MOST_CHANGES, change_limits
from biped.numerics.quadratic import MOST_STEPS, solve_in_box

EPSILON = 1e-3


def problem(rng: np.random.Generator, n: int):
    """P, r and limits of min ½ uᵀP u - rᵀu, |u| <= limit, and sides to begin from."""
    rows = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-1.0, 1.0, n)
    P = rows @ rows.T + EPSILON * np.eye(n)
    return P, P @ rng.normal(size=n), np.full(n, 0.5), rng.integers(-1, 2, n)


def minimised(P, r, limit, side, descend: bool = True):
    """The torques and the number of changes; as before without the descent, if so asked."""
    n, u = r.size, np.zeros(r.size)
    step = change_limits if descend else lambda turn, *others: change_limits(0, *others)
    for turn in range(MOST_CHANGES):
        free = side == 0
        x = np.zeros(n + 3)  # as a law's are, behind three of the base
        held = np.where(free, 0.0, side * limit)
        wanted = held.copy()
        wanted[free] = np.linalg.solve(P[np.ix_(free, free)], r[free] - P[np.ix_(free, ~free)] @ held[~free])
        pull = r - P @ wanted
        x[3:] = EPSILON * np.where(free, wanted, held + pull / EPSILON)
        if not step(turn, x, 0, 3, EPSILON, limit, side, u):
            return u, turn
    return u, MOST_CHANGES


def test_minimum_of_a_box_and_circles():
    rng, circles, n = np.random.default_rng(0), 0, 6
    for _ in range(3000):
        P, r, limit, began = problem(rng, n)
        side = began.copy()
        u, changes = minimised(P, r, limit, side)
        assert changes < MOST_CHANGES
        other = np.zeros(n)
        steps = solve_in_box(P, r, -limit, limit, np.zeros(n, np.int64), other, np.zeros((n, n)), np.zeros(n))
        assert steps < MOST_STEPS
        gap = 0.5 * u @ P @ u - r @ u - (0.5 * other @ P @ other - r @ other)
        assert abs(gap) < 1e-9 * abs(r @ other)
        if changes > limits.WORST_FIRST:
            circles += minimised(P, r, limit, began, descend=False)[1] == MOST_CHANGES
    assert circles > 0  # problems that the worst-first rule alone never ends


@pytest.mark.parametrize("above", [0, 2])
def test_coordinates_before_and_behind_the_base(above):
    limit, side, u = np.full(4, 10.0), np.zeros(4, np.int64), np.zeros(4)
    x = np.full(4 + 6, np.nan)
    wanted = np.array([1.0, 20.0, 3.0, 4.0])
    x[:above], x[above + 6 :] = EPSILON * wanted[:above], EPSILON * wanted[above:]
    assert change_limits(0, x, above, 6, EPSILON, limit, side, u)
    assert u.tolist() == pytest.approx(wanted.tolist())
    assert side.tolist() == [0, 1, 0, 0]
