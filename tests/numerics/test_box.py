"""Problems in a box against their optimality conditions and against other people's solvers."""

from __future__ import annotations

import numpy as np
import pytest

from biped.numerics.quadratic import MOST_STEPS, TOGETHER, solve_in_box

N = 6


def problem(rng: np.random.Generator, kind: str):
    """P, r and bounds: `definite`, `regularised` (rank 3 and a little), `tight` (nearly all at a bound)."""
    rows = rng.normal(size=(3 if kind == "regularised" else 12, N)) * 10.0 ** rng.uniform(-2, 2, N)
    P = rows.T @ rows
    P += 1e-8 * np.trace(P) * np.eye(N)
    r = rng.normal(size=N) * np.sqrt(np.diag(P)) * np.sqrt(np.trace(P))
    lower, upper = -rng.uniform(0.1, 1.0, N), rng.uniform(0.1, 1.0, N)
    scale = 0.05 if kind == "tight" else 1.0
    return P, r, scale * lower, scale * upper


def solved(P, r, lower, upper, side=None, start=None):
    side = np.zeros(N, np.int64) if side is None else side
    u = np.zeros(N) if start is None else start
    steps = solve_in_box(P, r, lower, upper, side, u, np.zeros((N, N)), np.zeros(N))
    return u, side, steps


def fault(P, r, lower, upper, u) -> float:
    """By how much the conditions of a minimum fail, relative to the numbers they are made of."""
    assert (lower <= u).all()
    assert (u <= upper).all()
    gradient, size = P @ u - r, np.abs(P) @ np.abs(u) + np.abs(r)
    pull = np.where(u == lower, np.maximum(-gradient, 0.0), np.where(u == upper, np.maximum(gradient, 0.0), gradient))
    return float((np.abs(pull) / size.max()).max())


@pytest.mark.parametrize("kind", ["definite", "regularised", "tight"])
def test_conditions_of_a_minimum(kind):
    rng = np.random.default_rng(1)
    side, used = np.zeros(N, np.int64), []
    for _ in range(500):
        P, r, lower, upper = problem(rng, kind)
        u, _, steps = solved(P, r, lower, upper, side)  # from whatever sets the last problem had
        assert fault(P, r, lower, upper, u) < 1e-12
        used.append(steps)
    assert max(used) < MOST_STEPS
    assert max(used) > 1


@pytest.mark.parametrize("solver", ["daqp", "quadprog"])
def test_other_solvers_agree(solver):
    qpsolvers = pytest.importorskip("qpsolvers")
    if solver not in qpsolvers.available_solvers:
        pytest.skip(f"{solver} is not installed")
    rng = np.random.default_rng(2)
    for _ in range(200):
        P, r, lower, upper = problem(rng, "definite")
        theirs = qpsolvers.solve_qp(P, -r, lb=lower, ub=upper, solver=solver)
        u, _, _ = solved(P, r, lower, upper)
        cost = lambda x: 0.5 * x @ P @ x - r @ x  # noqa: B023, E731
        assert cost(u) <= cost(np.clip(theirs, lower, upper)) + 1e-12 * abs(cost(u))
        np.testing.assert_allclose(theirs, u, atol=1e-5)


def test_where_all_at_once_goes_round_in_circles_one_at_a_time_does_not():
    rng = np.random.default_rng(3)
    turned = 0
    for _ in range(3000):
        P, r, lower, upper = problem(rng, "regularised")
        u, _, steps = solved(P, r, lower, upper)
        turned += steps > TOGETHER
        assert fault(P, r, lower, upper, u) < 1e-12
    assert turned > 10


def test_a_second_time_takes_one_step():
    P, r, lower, upper = problem(np.random.default_rng(4), "definite")
    u, side, _ = solved(P, r, lower, upper)
    again, _, steps = solved(P, r, lower, upper, side, u.copy())
    assert steps == 1
    np.testing.assert_array_equal(again, u)


def test_within_the_box_it_is_the_free_minimum():
    P, r, _, _ = problem(np.random.default_rng(5), "definite")
    far = np.full(N, 1e9)
    u, side, steps = solved(P, r, -far, far)
    assert steps == 1
    assert not side.any()
    np.testing.assert_allclose(P @ u, r, rtol=0, atol=1e-12 * np.abs(r).max())
