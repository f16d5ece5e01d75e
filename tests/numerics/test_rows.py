"""Reflections of rows in lanes against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from biped.numerics.factor import factor_lanes, reflect_few_back, solve_few, solve_lanes_transposed
from biped.numerics.lanes import FEW, LANES

N = 9


def factored(rows: np.ndarray, lanes: list[int], tolerance: float = 1e-10):
    """Rows (m, 9) in lanes of one's choice, factored; what stands in the other lanes is no row."""
    m = len(rows)
    C = np.random.default_rng(7).normal(size=(N, LANES)) * 100.0
    C[:, lanes] = rows.T
    given, kept = C.copy(), np.zeros((1, LANES))
    kept[0, lanes] = 1.0
    pivot, V, tau = np.zeros(N, np.int64), np.zeros((N, N)), np.zeros(N)
    independent = factor_lanes(C, kept, m, tolerance, pivot, V, tau)
    return independent, given, C, pivot[:m], V, tau


@pytest.mark.parametrize("m", range(N + 1))
def test_rows_become_a_triangle_by_an_orthogonal_matrix(m):
    rng = np.random.default_rng(m)
    lanes = sorted(rng.choice(LANES, m, replace=False))
    independent, given, C, pivot, V, tau = factored(rng.normal(size=(m, N)), lanes)
    assert independent
    assert sorted(pivot) == lanes
    parts = [np.ascontiguousarray(np.eye(N, 12)[:, at : at + FEW]) for at in range(0, 12, FEW)]
    for X in parts:
        reflect_few_back(V, tau, m, X)
    H = np.hstack(parts)[:, :N]
    np.testing.assert_allclose(H.T @ H, np.eye(N), atol=1e-14)
    np.testing.assert_allclose(C, H.T @ given, atol=1e-12)
    assert np.abs(np.triu(C[:, pivot].T, 1)).max(initial=0.0) < 1e-14
    assert (np.diff(np.abs(np.diag(C[:, pivot].T))) <= 0.0).all(), "the longest remainder comes next"


def test_solves_with_the_triangle():
    rng = np.random.default_rng(1)
    rows, lanes = rng.normal(size=(6, N)), [9, 2, 3, 7, 0, 11]
    _, _, C, pivot, V, tau = factored(rows, lanes)
    D, X = np.zeros((LANES, FEW)), np.zeros((N, FEW))
    D[lanes] = rng.normal(size=(6, FEW))
    solve_few(C, pivot, 6, D, X)
    z, x = X[:6, 1].copy(), np.zeros(LANES)
    solve_lanes_transposed(C, pivot, 6, z, x)
    reflect_few_back(V, tau, 6, X)
    shortest = np.linalg.pinv(rows)
    np.testing.assert_allclose(X, shortest @ D[lanes], atol=1e-12)
    np.testing.assert_allclose(x[lanes], shortest.T @ (shortest @ D[lanes, 1]), atol=1e-12)


@pytest.mark.parametrize(("size", "independent"), [(1e-8, True), (1e-12, False)])
def test_a_row_that_depends_on_others_is_told(size, independent):
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(5, N))
    rows[4] = rows[0] - rows[2] + size * rng.normal(size=N)
    assert factored(rows, [0, 1, 2, 3, 4])[0] == independent


def test_no_row_of_length_is_none():
    assert not factored(np.zeros((2, N)), [3, 4])[0]
