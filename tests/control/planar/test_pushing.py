"""Torques for ground that only pushes: each of the two problems against a library's solution, and what both promise."""

from __future__ import annotations

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.optimize import lsq_linear, nnls

from biped.scenario.devices import Actuation, Pushing
from biped.scenario.keys import Scenario
from biped.scenario.randomise import Randomise
from tests.ticks import Bench, E, dynamics, jdot_v, states

PUSHING = Actuation(torque_limit=1e9, contacts="pushing")


def edges(d, mu: float) -> np.ndarray:
    """G (10, 9) from MuJoCo's Jacobians."""
    rows = [d.J[2 * i] + side * mu * d.J[2 * i + 1] for i in range(4) for side in (1, -1)]
    return np.array([*rows, -np.eye(9)[4], -np.eye(9)[7]])


def least(q, v, d, keys: Pushing) -> np.ndarray:
    """b - gap (10,) from MuJoCo's Jacobians and their differences along the motion."""
    jv, out = jdot_v(q, v), []
    for i in range(4):
        speed, height = 2.0 * (d.J[2 * i] @ v) / keys.approach, d.height[i] / keys.approach**2
        gap = max(0.0, speed + height)
        gap = keys.braking * min(0.0, speed + max(0.0, height)) if gap == 0.0 else gap
        out += [-jv[2 * i] - side * keys.friction * jv[2 * i + 1] - gap for side in (1, -1)]
    return np.array(out + [-max(0.0, -2.0 * v[k] / keys.approach - q[k] / keys.approach**2) for k in (4, 7)])


def least_distance(C, d) -> np.ndarray:
    """min ‖y‖ subject to C y >= d, by Lawson and Hanson's reduction to non-negative least squares (1974, ch. 23)."""
    scale = max(1.0, np.abs(d).max())
    e = np.zeros(C.shape[1] + 1)
    e[-1] = 1.0
    r = np.vstack([C.T, d / scale]) @ nnls(np.vstack([C.T, d / scale]), e, maxiter=10000)[0] - e
    return -r[:-1] / r[-1] * scale


@pytest.mark.parametrize("braking", [0.0, 0.6])
def test_the_wanted_motion_is_gauss_s_on_ground_that_pushes(braking):
    asked = replace(PUSHING, pushing=Pushing(braking=braking))
    bench, seen, worst = Bench(Scenario(actuation=asked)), set(), 0.0
    for q, v in states(300, 1):
        bench.tick(q, v)
        d, c = dynamics(q, v), bench.c
        R = np.linalg.cholesky(d.M).T
        C = np.linalg.solve(R.T, edges(d, 1.0).T).T
        free = np.linalg.solve(R.T, c["tick"]["Q_d"] - d.h)
        low = least(q, v, d, asked.pushing) - C @ free
        ours, oracle = C.T @ c["push"]["wanted_force"][0, :10], least_distance(C, low)
        worst = max(worst, np.abs(ours - oracle).max() / max(1.0, np.abs(oracle).max()))
        assert c["push"]["wanted_force"][0, :10].min() >= 0.0
        assert (C @ ours - low).min() > -1e-6 * max(1.0, np.abs(low).max())
        seen.add(tuple(c["push"]["wanted_force"][0, :10] > 0.0))
    assert worst < 1e-6  # MuJoCo's J̇v is a central difference
    assert len(seen) > 40


@pytest.mark.parametrize("single", [False, True])
def test_a_foot_that_is_asked_once_cannot_contradict_itself(single):
    """Equal and opposite shear at the toe and heel of a flat foot moves nothing; believed of a wrong A, it did."""
    wrong = Randomise(controller_constraints=0.1)
    bench = Bench(Scenario(actuation=replace(PUSHING, single_tangential=single), randomise=wrong))
    right = Bench(Scenario(actuation=replace(PUSHING, single_tangential=single)))
    most = 0.0
    for q, v in states(100, 5):
        for ankle, at in ((5, (3, 4)), (8, (6, 7))):  # both feet flat: only then do the two say the same
            q[ankle] = -q[2] - q[list(at)].sum()
        for one in (bench, right):
            one.tick(q, v)
        G, true = bench.c["rows"]["A"][:, :8], right.c["rows"]["A"][:, :8]
        shear = [(G[:, k] - G[:, k + 1]) - (G[:, k + 2] - G[:, k + 3]) for k in (0, 4)]
        known = [(true[:, k] - true[:, k + 1]) - (true[:, k + 2] - true[:, k + 3]) for k in (0, 4)]
        assert np.abs(known).max() < 1e-12
        most = max(most, np.abs(shear).max())
    assert most < 1e-12 if single else most > 0.05


@pytest.mark.parametrize("stops", [True, False])
@pytest.mark.parametrize("limit", [1e9, 60.0, (90.0, 60.0, 30.0, 90.0, 60.0, 30.0)])
def test_the_torques_are_the_bounded_least_squares_solution(limit, stops):
    """The second problem as one bounded least-squares problem in u and c, by SciPy's active set method."""
    actuation = replace(PUSHING, torque_limit=limit, pushing=Pushing(regularisation=1e-3, stops=stops))
    counted = 10 if stops else 8
    bench, limited, leant_on, worst = Bench(Scenario(actuation=actuation)), 0, 0, 0.0
    keys, most = actuation.pushing, np.array(limit) * np.ones(6)
    for q, v in states(120, 2):
        u = bench.tick(q, v)
        d, push = dynamics(q, v), bench.c["push"]
        R, G = np.linalg.cholesky(d.M).T, edges(d, keys.friction)
        sides = np.array(push["side"]) != 0
        shank = 0.4428
        away = np.r_[np.repeat(np.maximum(0.0, d.height), 2), shank * np.maximum(0.0, -q[[4, 7]])] / keys.reach
        slack = push["slack"][0, :10] * np.r_[np.ones(8), shank, shank] / keys.yielding
        rho = np.r_[
            np.einsum("ij,jk,ik->i", G[:8, :3], np.linalg.inv(d.M[:3, :3]), G[:8, :3]), [keys.regularisation] * 2
        ]
        price = np.sqrt(rho * (away**2 + slack**2))
        target = bench.c["tick"]["Q_d"] + G.T @ push["wanted_force"][0, :10]
        whole = np.block([
            [np.linalg.solve(R.T, E), np.linalg.solve(R.T, G.T)],
            [np.sqrt(keys.regularisation) * np.eye(6), np.zeros((6, 10))],
            [np.zeros((10, 6)), np.diag(price)],
        ])  # fmt: skip
        whole = whole[:, : 6 + counted]
        right = np.r_[np.linalg.solve(R.T, target), np.zeros(16)]
        oracle = lsq_linear(
            whole, right, bounds=(np.r_[-most, np.zeros(counted)], np.r_[most, np.full(counted, np.inf)]),
            method="bvls", tol=1e-14, max_iter=2000,
        ).x[:6]  # fmt: skip
        worst = max(worst, np.abs(u - oracle).max() / max(1.0, np.abs(oracle).max()))
        limited += bool(sides.any())
        assert (np.abs(u) <= most).all()
        leant_on += int(bench.c["tick"]["active"][4:].any())
    assert leant_on > 20 if stops else leant_on == 0
    assert worst < 1e-7
    assert limited > 20 or limit == 1e9


def test_standing_flat_it_is_the_printed_formula():
    """Nothing lifts, every force may push and ε is nothing: what is left is (3.15)."""
    rng, compared = np.random.default_rng(5), 0
    actuation = replace(PUSHING, pushing=Pushing(regularisation=1e-7, friction=2.0, reach=1e-7))
    ours = Bench(Scenario(actuation=actuation))
    printed = Bench(Scenario(actuation=replace(PUSHING, contacts="touching")))
    for bench in (ours, printed):  # weak springs: gravity presses every touching point down
        for name in ("k_d1", "k"):
            bench.c["gait"][name] *= 0.05
    for _ in range(1500):
        q = np.zeros(9)
        q[3:] = rng.normal(0.0, 0.1, 6)
        q[[4, 7]] = -0.3 - 0.2 * rng.random(2)
        q[[5, 8]] = -(q[[3, 6]] + q[[4, 7]])
        q[1] -= dynamics(q, np.zeros(9)).height.min()
        height = dynamics(q, np.zeros(9)).height
        u, u_printed = ours.tick(q, np.zeros(9)), printed.tick(q, np.zeros(9))
        force, wanted, slack = (ours.c["push"][name][0, :10] for name in ("force", "wanted_force", "slack"))
        one = np.nonzero(height < 1e-9)[0]
        pressing = force[:8].reshape(4, 2).min(axis=1) > 0.0
        elsewhere = np.delete(force + wanted, np.r_[2 * one, 2 * one + 1])
        if not pressing[one].all() or slack[np.r_[2 * one, 2 * one + 1]].max() > 1e-9 or elsewhere.max() > 1e-3:
            continue
        compared += 1
        np.testing.assert_allclose(u, u_printed, rtol=1e-3, atol=2e-3)
    assert compared >= 8


def test_torques_are_continuous_where_the_release_test_jumps():
    """Along short lines through the state space, with leg states as they are: a jump does not shrink with the step."""

    def largest(contacts: str, count: int) -> float:
        bench = Bench(Scenario(actuation=replace(PUSHING, contacts=contacts)))
        rng, out = np.random.default_rng(6), 0.0
        for q, v in states(30, 6, speed=0.3):
            dq, dv = 1e-3 * rng.normal(size=9), 1e-2 * rng.normal(size=9)
            last, phase = None, None
            for s in np.linspace(0.0, 1.0, count):
                u = bench.tick(q + s * dq, v + s * dv)
                if last is not None and tuple(bench.c["memory"]["phase"]) == phase:
                    out = max(out, np.abs(u - last).max())
                last, phase = u, tuple(bench.c["memory"]["phase"])
        return out

    assert largest("pushing", 401) < 0.5 * largest("pushing", 101)
    assert largest("pushing", 401) < 4.0
    assert largest("released", 101) > 100.0
