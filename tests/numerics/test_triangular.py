"""The Cholesky factor and solves with it against numpy's."""

from __future__ import annotations

import numpy as np
import pytest

from biped.numerics.factor import (
    BLOCK,
    cholesky,
    solve_transposed,
    solve_transposed_block,
    solve_upper,
    weigh_rows,
)


def test_cholesky():
    rng = np.random.default_rng(2)
    X = rng.normal(size=(9, 9))
    M, R = X @ X.T + np.eye(9), np.zeros((9, 9))
    cholesky(np.triu(M) + np.tril(np.full((9, 9), np.nan), -1), R)  # the lower triangle is never read
    np.testing.assert_allclose(np.triu(R).T @ np.triu(R), M, atol=1e-12)
    np.testing.assert_allclose(np.triu(R), np.linalg.cholesky(M).T, atol=1e-12)


@pytest.mark.parametrize("lowest", [0.0, -1.0])
def test_cholesky_floors_the_pivots_of_an_indefinite_matrix(lowest):
    M, R = np.diag([4.0, 9.0, lowest]), np.zeros((3, 3))
    cholesky(M, R)
    np.testing.assert_allclose(np.diag(R), [2.0, 3.0, np.sqrt(9e-10)])


@pytest.mark.parametrize("n", [1, 4, 9, 12])
def test_solves_with_the_factor(n):
    """R⁻¹x, R⁻ᵀx, R⁻ᵀX and A R⁻¹, of any size; nothing below the diagonal of R is read."""
    rng = np.random.default_rng(n)
    R = np.triu(rng.normal(size=(n, n))) + 3.0 * np.eye(n)
    inverse = np.linalg.inv(R)
    given = R + np.tril(np.full((n, n), np.nan), -1)
    x = rng.normal(size=n)
    for solve, expected in ((solve_upper, inverse @ x), (solve_transposed, inverse.T @ x)):
        mine = x.copy()
        solve(given, mine)
        np.testing.assert_allclose(mine, expected, atol=1e-12)
    X = rng.normal(size=(n, BLOCK))
    block = X.copy()
    solve_transposed_block(given, block)
    np.testing.assert_allclose(block, inverse.T @ X, atol=1e-12)
    A, C = rng.normal(size=(5, n)), np.full((5, n), 7.0)
    weigh_rows(A, given, 3, C)
    np.testing.assert_allclose(C[:3], A[:3] @ inverse, atol=1e-12)
    assert (C[3:] == 7.0).all(), "rows that are not asked for stay"
