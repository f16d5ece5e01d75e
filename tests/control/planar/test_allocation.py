"""Joint torques (3.15) and (4.7) against dense pseudo-inverses, and the optimality of (3.13) without either."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from biped.control.planar.allocation import foreign_torques
from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.scenario.devices import Actuation
from biped.scenario.keys import Scenario, Start
from biped.scenario.randomise import Randomise
from biped.scenario.world import Ground
from tests.ticks import Bench, E, S, dynamics, jdot_v, rows_of, states, torques, well_ranked

FREE = Actuation(torque_limit=1e9, contacts="touching")
NONE = np.zeros(8)


def solved(bench: Bench, count: int, seed: int):
    """Ticks at random states whose ranks are clear: (q, v, dynamics, A, u)."""
    for q, v in states(count, seed):
        u = bench.tick(q, v)
        d = dynamics(q, v)
        A, _ = rows_of(bench.active, d, NONE)
        if well_ranked(d.M, A):
            yield q, v, d, A, u


@pytest.mark.parametrize("general", [False, True])
def test_torques_equal_the_printed_formula(general):
    bench, sets, worst = Bench(Scenario(actuation=FREE), general), set(), 0.0
    for _, _, d, A, u in solved(bench, 600, 1):
        oracle = torques(d.M, A, bench.c["tick"]["Q_d"], 1e-4)
        worst = max(worst, np.abs(u - oracle).max() / max(1.0, np.abs(oracle).max()))
        sets.add(bench.active)
    assert worst < 1e-10
    assert len(sets) > 25, "many different sets of contacts"


def test_torques_do_not_depend_on_gravity_or_coriolis():
    """(3.15) has neither h nor b_v: only which rows are in A may depend on them."""
    level, tilted = Bench(Scenario(actuation=FREE)), Bench(Scenario(actuation=FREE, ground=Ground(slope=20.0)))
    tilted.c["belief"]["tilt"] = 0.0
    for q, v, _, _, u in solved(level, 50, 2):
        np.testing.assert_allclose(tilted.tick(q, v), u, rtol=1e-9, atol=1e-9)


def accelerations(d, A, b, Q) -> np.ndarray:
    """Constrained accelerations (3.6) under generalized forces Q from the KKT system, by least squares."""
    m = len(A)
    K = np.block([[d.M, A.T], [A, np.zeros((m, m))]])
    return np.linalg.lstsq(K, np.concatenate([Q - d.h, b]), rcond=1e-11)[0][:9]


def test_torques_minimise_the_acceleration_energy():
    """(3.13): no gradient, nothing nearby is better, and no smaller torque does the same."""
    bench, rng, seen = Bench(Scenario(actuation=FREE)), np.random.default_rng(0), set()
    for q, v, d, A, u in solved(bench, 150, 3):
        _, b = rows_of(bench.active, d, jdot_v(q, v))
        if np.linalg.matrix_rank(A, tol=1e-6) < len(A):
            # Dependent rows must agree on their right-hand side for KKT to have a solution; any consistent one serves.
            b = A @ np.linalg.lstsq(A, b, rcond=1e-6)[0]
        wanted = accelerations(d, A, b, bench.c["tick"]["Q_d"])

        def gap(torque, d=d, A=A, b=b, wanted=wanted):
            return accelerations(d, A, b, E @ torque) - wanted

        def energy(torque, d=d, gap=gap):
            return gap(torque) @ d.M @ gap(torque)

        slope = np.column_stack([gap(u + e) - gap(u) for e in np.eye(6)])  # of q̈ in u, exact: q̈ is affine
        gradient = slope.T @ d.M @ gap(u)
        scale = np.abs(slope.T @ d.M @ slope).max() * max(1.0, np.abs(u).max())
        assert np.abs(gradient).max() < 1e-9 * scale
        best = energy(u)
        for _ in range(5):
            other = u + rng.normal(0.0, 10.0 ** rng.uniform(-3, 2), 6)
            assert energy(other) >= best - 1e-9 * max(1.0, best)
        _, s, Vt = np.linalg.svd(slope)
        idle = Vt[s < 1e-6 * s[0]]
        assert np.abs(idle @ u).max(initial=0.0) < 1e-7 * max(1.0, np.abs(u).max()), "u has a part that does nothing"
        seen.add(len(idle))
    assert seen >= {0, 1, 2}, "fully, over- and underactuated cases"


@pytest.mark.parametrize("general", [False, True])
def test_general_solution_with_u_0(general):
    """(4.7): u_0 shows where the torques are not unique, and nowhere else."""
    u_0 = (30.0, -20.0, 10.0, -40.0, 50.0, -60.0)
    plain = Bench(Scenario(actuation=FREE))
    bench = Bench(Scenario(actuation=Actuation(torque_limit=1e9, contacts="touching", null_torque=u_0)), general)
    differs = same = 0
    for q, v, d, A, u in solved(bench, 200, 4):
        oracle = torques(d.M, A, bench.c["tick"]["Q_d"], 1e-4, np.array(u_0))
        np.testing.assert_allclose(u, oracle, atol=1e-10 * max(1.0, np.abs(oracle).max()))
        moved = np.abs(u - plain.tick(q, v)).max()
        differs, same = differs + (moved > 1.0), same + (moved < 1e-7)
    assert differs > 20
    assert same > 20


def test_one_tangential_row_per_flat_foot_says_the_same():
    """With exact rows the second tangential row of a flat foot is redundant: torques are the same without it."""
    double = Bench(Scenario(actuation=FREE), general=True)
    less = Actuation(torque_limit=1e9, contacts="touching", single_tangential=True)
    single = Bench(Scenario(actuation=less), general=True)
    flat = 0
    for q, v, d, _, u in solved(double, 500, 5):
        lone = single.tick(q, v)
        feet = sum(double.active[i] and double.active[i + 1] for i in (0, 2))
        assert single.c["tick"]["rows"] == double.c["tick"]["rows"] - feet
        rows = list(single.c["work"]["row"][: single.c["tick"]["rows"]])
        for i in (0, 2):
            if double.active[i] and double.active[i + 1]:
                assert 2 * i + 1 not in rows
                assert {2 * i, 2 * i + 2, 2 * i + 3} <= set(rows)
        level = all(
            abs(d.height[i] - d.height[i + 1]) < 1e-9 for i in (0, 2) if double.active[i] and double.active[i + 1]
        )
        if feet and level:
            flat += 1
            np.testing.assert_allclose(lone, u, rtol=1e-7, atol=1e-6)
    assert flat > 20


def test_clipping():
    limits = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
    free = Bench(Scenario(actuation=FREE))
    clipped = Bench(Scenario(actuation=Actuation(torque_limit=limits, contacts="touching")))
    over = 0
    for q, v, _, _, u in solved(free, 50, 6):
        np.testing.assert_array_equal(clipped.tick(q, v), np.clip(u, -np.array(limits), limits))
        assert bool(clipped.c["tick"]["over"]) == bool((np.abs(u) > limits).any())
        over += bool(clipped.c["tick"]["over"])
    assert over > 20


BOUNDED = Actuation(torque_limit=40.0, contacts="touching", limit="bounded")


@pytest.mark.parametrize("solver", ["active_set", "daqp", "quadprog", "osqp"])
def test_bounded_form_against_an_active_set_solver(solver):
    bench = Bench(Scenario(actuation=msgspec.structs.replace(BOUNDED, solver=solver)))
    unique = compared = 0
    for _, _, d, A, exact in solved(bench, 60, 7):
        if not bench.c["tick"]["over"]:
            continue
        u = exact if solver == "active_set" else foreign_torques(bench.record, bench.c["work"]["M"], solver)
        assert np.abs(u).max() <= 40.0
        R = np.linalg.cholesky(d.M).T
        C = A @ np.linalg.inv(R)
        N = np.eye(9) - np.linalg.pinv(C, rcond=1e-4) @ C if len(A) else np.eye(9)
        B, wanted = N @ np.linalg.inv(R).T @ E, N @ np.linalg.inv(R).T @ bench.c["tick"]["Q_d"]
        best = lsq_linear(B, wanted, (-40.0, 40.0), method="bvls", tol=1e-14)
        cost = 0.5 * np.sum((B @ u - wanted) ** 2)
        clipped = np.clip(torques(d.M, A, bench.c["tick"]["Q_d"], 1e-4), -40.0, 40.0)
        assert cost <= best.cost * (1 + 1e-4) + 1e-6 * wanted @ wanted
        assert cost <= 0.5 * np.sum((B @ clipped - wanted) ** 2) * (1 + 1e-6) + 1e-9
        s = np.linalg.svd(B, compute_uv=False)
        if s[-1] > 0.02 * s[0]:
            np.testing.assert_allclose(u, best.x, atol=0.05)
            unique += 1
        compared += 1
    assert compared > 15
    assert unique > 3


def walked_bounded(wrong: Randomise, limit: float = 60.0):
    """Ticks of a walk within limits: the bench after each whose torques exceeded one, and u."""
    act = Actuation(torque_limit=limit, limit="bounded")
    walk = simulate(Plan(Scenario(duration=1.5, start=Start(posture="heel_toe"), actuation=act)).run(0))
    assert walk.end == "completed"
    bench = Bench(Scenario(actuation=act, randomise=wrong))
    for k in range(len(walk)):
        u = bench.tick(walk.q[k].copy(), walk.v[k].copy())
        if bench.c["tick"]["over"]:
            yield bench, u


@pytest.mark.parametrize("wrong", [Randomise(), Randomise(controller_mass_matrix=0.05, controller_constraints=0.05)])
def test_bounded_torques_meet_the_conditions_of_a_minimum(wrong):
    """In a walk, each tick beginning at the last one's limits: exact, where OSQP was off by newton metres."""
    count, held = 0, set()
    for bench, u in walked_bounded(wrong):
        P, r = bench.c["work"]["P"], bench.c["work"]["r"]
        gradient, size = P @ u - r, np.abs(P) @ np.abs(u) + np.abs(r)
        assert np.abs(u).max() <= 60.0
        pull = np.where(
            u == 60.0, np.maximum(gradient, 0.0), np.where(u == -60.0, np.maximum(-gradient, 0.0), gradient)
        )
        assert np.abs(pull).max() < 1e-12 * size.max()
        held.add(int((np.abs(u) == 60.0).sum()))
        count += 1
    assert count > 300
    assert held >= {1, 2, 3}


@pytest.mark.parametrize(("solver", "near"), [("daqp", 1e-5), ("quadprog", 1e-5), ("osqp", 5.0)])
def test_other_solvers_find_the_same_bounded_torques(solver, near):
    compared = 0
    for i, (bench, u) in enumerate(walked_bounded(Randomise())):
        if i % 20 == 0:
            theirs = foreign_torques(bench.record, bench.c["work"]["M"], solver)
            np.testing.assert_allclose(theirs, u, rtol=0, atol=near)
            compared += 1
    assert compared > 15


def dense_factors(bench: Bench) -> tuple[np.ndarray, np.ndarray]:
    """Symmetric elementwise factors of M and those of A, in the thesis's absolute coordinates."""
    belief = bench.c["belief"]
    upper = np.triu(belief["mass_factor"])
    return upper + np.triu(upper, 1).T, belief["row_factor"]


@pytest.mark.parametrize(("drawn", "seed"), [("run", 0), ("run", 1), ("run", 2), ("tick", 3)])
def test_model_error_is_elementwise_in_absolute_coordinates(drawn, seed):
    """M and A of the controller, multiplied elementwise in the coordinates that the thesis uses, done densely."""
    wrong = Randomise(controller_mass_matrix=0.02, controller_constraints=0.1, controller_errors=drawn)
    bench = Bench(Scenario(actuation=FREE, randomise=wrong, seed=seed))
    compared = 0
    for q, v in states(60, 10 + seed):
        u = bench.tick(q, v)
        F, rows = dense_factors(bench)
        d = dynamics(q, v)
        T = np.linalg.inv(S)  # absolute rates from joint rates
        M = T.T @ ((S.T @ d.M @ S) * F) @ T
        A, _ = rows_of(bench.active, d, NONE)
        numbers = [2 * i + j for i in range(4) if bench.active[i] for j in range(2)]
        numbers += [8 + leg for leg in range(2) if bench.active[4 + leg]]
        A = ((A @ S) * rows[numbers]) @ T
        np.testing.assert_allclose(bench.c["work"]["A"][: len(A)], A, atol=1e-12)
        R = bench.c["work"]["R"]
        np.testing.assert_allclose(np.triu(R).T @ np.triu(R), M, atol=1e-10)
        if well_ranked(M, A):
            oracle = torques(M, A, bench.c["tick"]["Q_d"], 1e-4)
            np.testing.assert_allclose(u, oracle, atol=1e-9 * max(1.0, np.abs(oracle).max()))
            compared += 1
    assert compared > 15


def test_torques_survive_an_indefinite_model():
    """At 50 % error M need not be positive definite: pivots are floored, torques stay finite and limited."""
    for seed in range(5):
        wrong = Randomise(controller_mass_matrix=0.5, controller_constraints=0.5)
        bench = Bench(Scenario(randomise=wrong, seed=seed))
        for q, v in states(20, seed):
            u = bench.tick(q, v)
            assert np.isfinite(u).all()
            assert np.abs(u).max() <= 200.0
