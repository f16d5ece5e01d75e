"""The compiled decomposition against numpy's, for any shape and rank."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from biped.numerics.factor import (
    factor_rows,
    least_squares,
    minimum_norm,
    reflect,
    reflect_back,
    transposed_minimum_norm,
)


def matrix(rng, k: int, n: int, rank: int, spread: float = 1.0) -> np.ndarray:
    """A k x n matrix of the given rank with singular values from 10^-spread to 1."""
    U, _ = np.linalg.qr(rng.normal(size=(k, k)))
    V, _ = np.linalg.qr(rng.normal(size=(n, n)))
    s = np.zeros((k, n))
    s[range(rank), range(rank)] = np.logspace(0.0, -spread, rank) if rank else []
    return U @ s @ V


def pseudo_inverse(B: np.ndarray, tolerance: float = 1e-12) -> np.ndarray:
    """The pseudo-inverse (n, k) of B (k, n) by the compiled kernels."""
    k, n = B.shape
    out = np.empty((n, k))
    wide = max(k, n)
    for j in range(k):
        d = np.zeros(k)
        d[j] = 1.0
        x = np.empty(n)
        minimum_norm(
            np.array(B, dtype=float), k, n, tolerance, np.empty(wide), np.empty(wide, np.int64),
            np.empty((wide, wide)), np.empty(wide), d, np.empty(wide), x,
        )  # fmt: skip
        out[:, j] = x
    return out


shapes = st.tuples(st.integers(1, 10), st.integers(1, 9)).flatmap(
    lambda s: st.tuples(st.just(s[0]), st.just(s[1]), st.integers(0, min(s)))
)


@given(shapes, st.integers(0, 2**32 - 1))
@settings(max_examples=200, deadline=None)
def test_pseudo_inverse(shape, seed):
    k, n, rank = shape
    B = matrix(np.random.default_rng(seed), k, n, rank)
    if rank == 0:
        B[:] = 0.0
    np.testing.assert_allclose(pseudo_inverse(B), np.linalg.pinv(B, rcond=1e-10), atol=1e-11)


def test_pseudo_inverse_is_what_moore_and_penrose_say():
    rng = np.random.default_rng(0)
    for k, n, rank in ((4, 7, 3), (7, 4, 4), (6, 6, 2), (10, 9, 9)):
        B = matrix(rng, k, n, rank, spread=3.0)
        X = pseudo_inverse(B, 1e-9)
        np.testing.assert_allclose(B @ X @ B, B, atol=1e-10)
        np.testing.assert_allclose(X @ B @ X, X, atol=1e-8)
        np.testing.assert_allclose((B @ X).T, B @ X, atol=1e-10)
        np.testing.assert_allclose((X @ B).T, X @ B, atol=1e-10)


def factored(B: np.ndarray, tolerance: float = 1e-9):
    k, n = B.shape
    F, tau, pivot = B.copy(), np.zeros(k), np.zeros(k, np.int64)
    return F, tau, pivot, factor_rows(F, k, n, tolerance, tau, pivot)


@given(shapes, st.integers(0, 2**32 - 1))
@settings(max_examples=100, deadline=None)
def test_minimum_norm_multipliers(shape, seed):
    """λ = (C Cᵀ)⁺ d, as the release test needs it."""
    k, n, rank = shape
    rng = np.random.default_rng(seed)
    C = matrix(rng, k, n, rank) if rank else np.zeros((k, n))
    d = rng.normal(size=k)
    F, _, pivot, found = factored(C)
    assert found == rank
    L, tau2, z, out = np.zeros((10, 10)), np.zeros(10), np.zeros(10), np.zeros(k)
    least_squares(F, k, found, pivot, L, tau2, d, z)
    transposed_minimum_norm(F, k, found, pivot, L, tau2, z, out)
    inverse = np.linalg.pinv(C, rcond=1e-10)
    np.testing.assert_allclose(out, inverse.T @ (inverse @ d), atol=1e-9)


def test_reflections_are_orthogonal_and_span_the_rows():
    rng = np.random.default_rng(1)
    for k, n, rank in ((3, 9, 3), (10, 9, 7), (5, 9, 2)):
        C = matrix(rng, k, n, rank)
        F, tau, _, found = factored(C)
        H = np.array([np.eye(n)[i] for i in range(n)])
        for row in H:
            reflect(F, found, n, tau, row)  # rows of H are eᵢᵀH
        np.testing.assert_allclose(H @ H.T, np.eye(n), atol=1e-13)
        np.testing.assert_allclose((C @ H)[:, rank:], 0.0, atol=1e-12)  # CH = P'[L 0]
        back = H.copy()
        for row in back:
            reflect_back(F, found, n, tau, row)
        np.testing.assert_allclose(back, np.eye(n), atol=1e-13)


def test_rank_tolerance_is_relative_to_the_longest_row():
    B = np.diag([1e6, 1e6, 1.0])
    assert factored(B, 1e-5)[3] == 2
    assert factored(B, 1e-7)[3] == 3
    assert factored(1e-9 * B, 1e-7)[3] == 3
    assert factored(np.zeros((3, 3)))[3] == 0
