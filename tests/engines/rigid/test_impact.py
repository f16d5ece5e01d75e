"""Impacts (3.5): the active-set solution against OSQP, its own optimality, and physics."""

import warnings

import numpy as np
import pytest
import qpsolvers
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_matrix

from biped.base.files import locate
from biped.engines.home import rigid_record
from biped.engines.rigid.gauss import unilateral
from biped.engines.rigid.motion import active_rows, evaluate, impact, mass_and_bias, place, prepare
from biped.robot.planar.model import tree_at

HUMAN = locate("models", "human", "test")


def new(seed):
    """A record at a random posture that is near standing, its active set, and a velocity towards the ground."""
    rng = np.random.default_rng(seed)
    w = rigid_record(tree_at(HUMAN), 0.0)[0]
    q = rng.uniform(-0.6, 0.6, 9)
    q[[4, 7]] = -np.abs(q[[4, 7]]) * (rng.random(2) < 0.7)
    v = rng.uniform(-3.0, 3.0, 9)
    active = (rng.random(6) < 0.6).astype(np.uint8)
    active[[0, 2]] &= 1 - active[[1, 3]]  # toe and heel of a foot touch together only if it is flat
    if not active.any():
        active[rng.integers(6)] = 1
    w["contact"]["active"] = active
    return w, q, v


def flat(w, q):
    """The same posture with both feet parallel to the ground: rows of toe and heel are then redundant."""
    q[[5, 8]] = -q[2] - q[[3, 6]] - q[[4, 7]]
    w["contact"]["active"][:4] = 1


def signed_rows(w, q, v):
    place(w, q, v)
    mass_and_bias(w)
    m = active_rows(w)
    M = np.triu(w["system"]["M"]) + np.triu(w["system"]["M"], 1).T
    return M, w["system"]["A"][:m].copy(), w["system"]["signed"][:m].astype(bool)


def reference(M, A, signed, v):
    """(3.5) as a quadratic program by OSQP, in x = R v: a first-order method wants the identity for a Hessian."""
    R = np.linalg.cholesky(M).T
    C = A @ np.linalg.inv(R)
    G, E = C[signed], C[~signed]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PendingDeprecationWarning)  # OSQP about its own default
        x = qpsolvers.solve_qp(
            csc_matrix(np.eye(9)), -(R @ v), csc_matrix(-G), np.zeros(len(G)),
            *((csc_matrix(E), np.zeros(len(E))) if len(E) else ()),
            solver="osqp", eps_abs=1e-9, eps_rel=1e-9, max_iter=100000, polishing=False,
        )  # fmt: skip
    return np.linalg.solve(R, x)


@pytest.mark.parametrize("feet_flat", [False, True], ids=["any posture", "feet flat: redundant rows"])
def test_impact_equals_osqp(feet_flat):
    parted = 0
    for seed in range(150):
        w, q, v = new(seed)
        if feet_flat:
            flat(w, q)
        M, A, signed = signed_rows(w, q, v)
        wanted = reference(M, A, signed, v)
        after = v.copy()
        impact(w, q, after)
        # OSQP's first-order solution is the less exact of the two: compare in the metric that is minimised.
        e = after - wanted
        assert e @ M @ e < 1e-10 * (v @ M @ v), seed
        parted += int((A[signed] @ after > 1e-6).any())
    assert parted > 20  # the inequalities mattered


@given(st.integers(0, 2**31), st.booleans())
@settings(max_examples=300, deadline=None)
def test_impact_satisfies_3_4_is_optimal_and_never_adds_energy(seed, feet_flat):
    w, q, v = new(seed)
    if feet_flat:
        flat(w, q)
    M, A, signed = signed_rows(w, q, v)
    after = v.copy()
    impact(w, q, after)
    speed = 1e-11 * np.abs(v).max()
    assert (A[signed] @ after > -speed).all()  # (3.4)
    assert np.abs(A[~signed] @ after).max(initial=0.0) < speed
    lost = 0.5 * (v @ M @ v - after @ M @ after)
    assert lost > -1e-12 * (v @ M @ v)
    assert w["ledger"]["loss"] == pytest.approx(lost, abs=1e-11 * (v @ M @ v))
    # Karush-Kuhn-Tucker: the change comes from the rows alone, no row pulls, and what parts is not pushed.
    rows = w["system"]["row"][: len(A)]
    impulse = w["ledger"]["impulse"][rows]
    momentum = np.abs(M @ v).max()
    np.testing.assert_allclose(M @ (after - v), A.T @ impulse, rtol=0, atol=1e-9 * momentum)
    assert (impulse[signed] > -1e-12 * momentum).all()
    assert np.abs(impulse[signed] * (A[signed] @ after)).max(initial=0.0) < 1e-10 * momentum
    # Gauss: a plastic impact is a projection, so the energy of the change is the energy lost.
    assert 0.5 * (after - v) @ M @ (after - v) == pytest.approx(lost, abs=1e-10 * (v @ M @ v))
    again = after.copy()
    impact(w, q, again)
    np.testing.assert_allclose(again, after, rtol=0, atol=1e-10 * np.abs(v).max())


def test_a_held_constraint_does_not_part():
    found = 0
    for seed in range(40):
        w, q, v = new(seed)
        _, A, signed = signed_rows(w, q, v)
        free = v.copy()
        impact(w, q, free)
        parting = A[signed] @ free > 1e-6
        w, q, v = new(seed)
        w["contact"]["held"] = 1
        held = v.copy()
        impact(w, q, held)
        assert np.abs(A @ held).max() < 1e-10
        assert w["ledger"]["loss"] >= 0.0
        found += int(parting.any())
    assert found > 5


def test_duplicated_rows_change_nothing():
    for seed in range(50):
        w, q, v = new(seed)
        evaluate(w, q, v)
        m = prepare(w)
        if m > 5:
            continue
        rng = np.random.default_rng(seed)
        y0 = rng.normal(size=9)
        w["work"]["y"] = y0
        unilateral(w, m)
        once = w["work"]["multiplier"][:m] @ w["system"]["C"][:m]
        w["system"]["C"][m : 2 * m] = 1e3 * w["system"]["C"][:m]
        w["system"]["signed"][m : 2 * m] = w["system"]["signed"][:m]
        w["work"]["y"] = y0
        unilateral(w, 2 * m)
        twice = w["work"]["multiplier"][: 2 * m] @ w["system"]["C"][: 2 * m]
        np.testing.assert_allclose(twice, once, rtol=0, atol=1e-11)


def test_constrained_acceleration_is_3_7_with_a_dense_pseudo_inverse():
    for seed in range(100):
        w, q, v = new(seed)
        w["acting"]["Q"] = np.random.default_rng(seed).normal(scale=100.0, size=9)
        M, A, _ = signed_rows(w, q, v)
        # (3.3) presumes velocities on the constraints.
        v -= np.linalg.pinv(A) @ (A @ v)
        evaluate(w, q, v)
        m = active_rows(w)
        R = np.linalg.cholesky(M).T
        C = A @ np.linalg.inv(R)
        a = np.linalg.solve(M, w["acting"]["Q"] - w["system"]["h"])
        wanted = a + np.linalg.solve(R, np.linalg.pinv(C, rcond=1e-10) @ (w["system"]["b_v"][:m] - A @ a))
        np.testing.assert_allclose(w["motion"]["v_dot"], wanted, rtol=0, atol=1e-9 * np.abs(a).max())
        np.testing.assert_allclose(w["motion"]["q_dot"], v, rtol=0, atol=1e-12)
        force = A.T @ w["motion"]["lam"][w["system"]["row"][:m]]
        np.testing.assert_allclose(
            M @ w["motion"]["v_dot"],
            w["acting"]["Q"] - w["system"]["h"] + force,
            rtol=0,
            atol=1e-8 * np.abs(force).max(),
        )
