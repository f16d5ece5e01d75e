import numpy as np
import pytest

from biped.dynamics.linalg import apply_w, factor, solve_mass
from biped.dynamics.orthogonal import workspace


def random_mass(rng, n, spread=1.0):
    B = rng.normal(size=(n, n))
    D = np.diag(10.0 ** rng.uniform(-spread, spread, n))
    return D @ (B @ B.T + n * np.eye(n)) @ D


def oracle(M, A, b):
    """R⁻¹(AR⁻¹)⁺b by SVD."""
    R = np.linalg.cholesky(M).T
    return np.linalg.solve(R, np.linalg.pinv(A @ np.linalg.inv(R), rcond=1e-12) @ b)


def ours(M, A, b):
    w = workspace(*A.shape[::-1])
    assert factor(M, A, w)
    out = np.zeros(A.shape[1])
    apply_w(b, w, out)
    return out, w


@pytest.mark.parametrize("n", [1, 2, 5, 12])
def test_full_rank_matches_the_pseudoinverse_on_any_right_hand_side(n):
    rng = np.random.default_rng(n)
    for m in range(1, n + 1):
        M, A, b = random_mass(rng, n), rng.normal(size=(m, n)), rng.normal(size=m)
        x, w = ours(M, A, b)
        expected = oracle(M, A, b)
        assert w.rank[0] == m
        np.testing.assert_allclose(x, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e3])
def test_redundant_rows_change_nothing(scale):
    rng = np.random.default_rng(7)
    for n, m in ((2, 1), (6, 4), (9, 9)):
        M, A = random_mass(rng, n), rng.normal(size=(m, n))
        b = A @ rng.normal(size=n)
        once, _ = ours(M, A, b)
        twice, w = ours(M, np.vstack((A, scale * A)), np.concatenate((b, scale * b)))
        assert w.rank[0] == m
        np.testing.assert_allclose(twice, once, rtol=0, atol=1e-10 * np.abs(once).max())


def test_inconsistent_redundant_rows_of_equal_length_give_the_least_squares_answer():
    rng = np.random.default_rng(3)
    Q, _ = np.linalg.qr(rng.normal(size=(5, 5)))
    A = np.vstack((Q[:3], Q[0], Q[1]))
    b = rng.normal(size=5)
    x, w = ours(np.eye(5), A, b)
    assert w.rank[0] == 3
    np.testing.assert_allclose(x, np.linalg.pinv(A) @ b, atol=1e-14)


@pytest.mark.parametrize("angle", [1e-1, 1e-4, 1e-8, 1e-11])
def test_nearly_parallel_rows_keep_their_rank_and_report_how_near(angle):
    A = np.array([[1.0, 0.0, 0.0], [np.cos(angle), np.sin(angle), 0.0]])
    x, w = ours(np.eye(3), A, A @ np.array([0.3, -0.2, 0.0]))
    assert w.rank[0] == 2
    assert w.ratio[0] == pytest.approx(np.sin(angle), rel=1e-4)
    assert x == pytest.approx([0.3, -0.2, 0.0], abs=1e-15 / angle)


def test_rows_of_very_different_units_all_count():
    A = np.array([[1.0, 0.0, 0.0], [1e-9, 1e-9, 0.0], [0.0, 0.0, 1e9]])
    x, w = ours(np.eye(3), A, A @ np.array([1.0, 2.0, 3.0]))
    assert w.rank[0] == 3
    np.testing.assert_allclose(x, [1.0, 2.0, 3.0], rtol=1e-12)


def test_a_row_of_zeros_is_ignored():
    x, w = ours(np.eye(2), np.array([[0.0, 0.0], [0.0, 2.0]]), np.array([5.0, 2.0]))
    assert w.rank[0] == 1
    np.testing.assert_allclose(x, [0.0, 1.0])


def test_no_constraints_at_all():
    x, w = ours(2.0 * np.eye(3), np.zeros((0, 3)), np.zeros(0))
    assert (w.rank[0], w.ratio[0]) == (0, 1.0)
    assert not x.any()


def test_solve_mass_and_its_reuse_when_the_mass_changes():
    rng = np.random.default_rng(1)
    w, A, out = workspace(4, 1), np.ones((1, 4)), np.zeros(4)
    for spread in (0.0, 3.0, 0.0):
        M, Q = random_mass(rng, 4, spread), rng.normal(size=4)
        assert factor(M, A, w)
        solve_mass(Q, w, out)
        np.testing.assert_allclose(M @ out, Q, atol=1e-10 * np.abs(M).max() * np.abs(out).max())


@pytest.mark.parametrize(
    "M", [-np.eye(2), np.array([[1.0, 2.0], [2.0, 1.0]]), np.ones((2, 2)), np.full((2, 2), np.nan)]
)
def test_a_mass_matrix_that_is_not_positive_definite_is_refused_again_and_again(M):
    w = workspace(2, 1)
    assert factor(np.eye(2), np.ones((1, 2)), w)
    assert not factor(M, np.ones((1, 2)), w)
    assert not factor(M, np.ones((1, 2)), w)
    assert factor(np.eye(2), np.ones((1, 2)), w)
