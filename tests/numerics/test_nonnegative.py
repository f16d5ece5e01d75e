"""Problems in non-negative unknowns, against Lawson and Hanson's algorithm and against their own conditions."""

from __future__ import annotations

import numpy as np
import pytest
import qpsolvers
from scipy.optimize import nnls

from biped.numerics.lanes import LANES
from biped.numerics.quadratic import MOST, nonnegative


def wide(n):
    """Lanes for n numbers."""
    return LANES * -(-n // LANES)


def lanes(x):
    """Numbers in the first lanes of rows; what stands in the others must not matter."""
    x = np.atleast_2d(x)
    return np.hstack([x, np.full((len(x), wide(x.shape[1]) - x.shape[1]), np.pi)])


def solved(B, d, free=None):
    """min ½‖B x - d‖², x >= 0: x, its multipliers, how often the set changed, and the set."""
    n = B.shape[1]
    x, y = np.zeros((1, wide(n))), np.zeros((1, wide(n)))
    free = np.zeros(n, np.uint8) if free is None else free
    order, rows, work = np.zeros(n, np.int64), np.full((n, wide(n)), np.nan), np.zeros((n, n))
    changes = nonnegative(lanes(B.T @ B), lanes(B.T @ d), n, free, order, rows, work, x, y)
    assert not x[0, n:].any()
    return x[0, :n], y[0, :n], changes, free


@pytest.mark.parametrize("n", [1, 2, 5, 10, 20, 34])
def test_equals_lawson_and_hanson(n):
    rng = np.random.default_rng(n)
    kinds = set()
    for _ in range(300):
        B, d = rng.normal(size=(n + 2, n)), 10.0 * rng.normal(size=n + 2)
        x, y, changes, _ = solved(B, d)
        np.testing.assert_allclose(x, nnls(B, d)[0], rtol=1e-9, atol=1e-9)
        assert changes < MOST
        assert (x >= 0.0).all()
        assert y.min() > -1e-10 * max(1.0, np.abs(B.T @ d).max())
        np.testing.assert_allclose(x * y, 0.0, atol=1e-12)
        kinds.add(tuple(x > 0.0))
    assert len(kinds) > min(2**n - 1, 30) // 2, "many different sets of positive unknowns"


def test_every_start_leads_to_the_same_solution_and_the_right_one_at_once():
    rng = np.random.default_rng(3)
    B, d = rng.normal(size=(12, 8)), rng.normal(size=12)
    x, _, changes, right = solved(B, d)
    assert changes > 0
    for code in range(256):
        other, _, _, _ = solved(B, d, np.array([code >> i & 1 for i in range(8)], np.uint8))
        np.testing.assert_allclose(other, x, rtol=1e-10, atol=1e-12)
    assert solved(B, d, right.copy())[2] == 0


def test_nearly_dependent_columns_that_circle_still_end():
    """Two feet flat: four edges of rank three each, kept apart by a hair only."""
    rng = np.random.default_rng(4)
    for _ in range(200):
        B = rng.normal(size=(9, 7)) @ rng.normal(size=(7, 10))
        H = B.T @ B
        H += 1e-12 * H.max() * np.eye(10)
        f, x, y = B.T @ (5.0 * rng.normal(size=9)), np.zeros((1, LANES)), np.zeros((1, LANES))
        free, order = np.zeros(10, np.uint8), np.zeros(10, np.int64)
        assert nonnegative(lanes(H), lanes(f), 10, free, order, np.zeros((10, LANES)), np.zeros((10, 10)), x, y) < MOST
        x = x[0, :10]
        slack = B.T @ (B @ x) - f
        assert slack.min() > -1e-7 * np.abs(f).max()
        assert abs(slack @ x) < 1e-6 * np.abs(f).max() * max(1.0, x.max())


def feet(rng):
    """(18, 32) what two flat feet's pyramids do to a walker: edges of four corners each, sixteen forces of rank six."""
    wrenches = np.zeros((12, 32))
    for k in range(32):
        foot, corner, edge = k // 16, k // 4 % 4, k % 4
        place = np.array([(-0.1, 0.15)[corner % 2], (-0.04, 0.04)[corner // 2], -0.05])
        force = np.array([0.0, 0.0, 1.0])
        force[edge // 2] = (0.8, -0.8)[edge % 2]
        wrenches[6 * foot : 6 * foot + 6, k] = *force, *np.cross(place, force)
    return rng.normal(size=(18, 12)) @ wrenches


def test_two_flat_feet_move_as_a_library_says_from_problem_to_problem():
    """Corners are asked for what no rigid foot can do quite: which of sixteen forces push is then nearly a tie."""
    rng = np.random.default_rng(5)
    most, kinds = 0, set()
    for _ in range(10):
        B, d, free = feet(rng), 30.0 * rng.normal(size=18), np.zeros(32, np.uint8)
        for _ in range(20):
            d += 3.0 * rng.normal(size=18)
            asked = 1e-4 * rng.normal(size=32)
            H, x, y = B.T @ B, np.zeros((1, wide(32))), np.zeros((1, wide(32)))
            H += 1e-9 * H.max() * np.eye(32)
            work = np.zeros(32, np.int64), np.zeros((32, wide(32))), np.zeros((32, 32))
            most = max(most, nonnegative(lanes(H), lanes(B.T @ d + asked), 32, free, *work, x, y))
            moved = qpsolvers.solve_qp(np.eye(18), d, -B.T, -asked, solver="quadprog")
            assert moved is not None
            np.testing.assert_allclose(B @ x[0, :32] - d, moved, atol=1e-6 * np.abs(d).max())
            kinds.add(tuple(x[0, :32] > 0.0))
    assert len(kinds) > 50, "many different sets of forces"
    assert most < 60, "the set goes straight to the solution"
