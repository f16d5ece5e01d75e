"""Rows of A, their accelerations, and the release test, against a dense reference in plain loops."""

from __future__ import annotations

import numpy as np
import pytest

from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.scenario.devices import Actuation
from biped.scenario.keys import Scenario, Start
from biped.scenario.world import Ground
from tests.ticks import Bench, dynamics, jdot_v, rows_of, states, torques, well_ranked

FREE = Actuation(torque_limit=1e9)
TOUCHING = Actuation(torque_limit=1e9, contacts="touching")


def test_candidates_are_low_points_and_straight_knees():
    bench = Bench(Scenario(actuation=TOUCHING))
    for q, v in states(60, 20):
        bench.tick(q, v)
        d = dynamics(q, v)
        assert bench.active == (*(d.height < 0.001), -q[4] < 0.02, -q[7] < 0.02)
        np.testing.assert_allclose(bench.c["tick"]["height"], d.height, atol=1e-13)


def test_rows_and_their_accelerations():
    """A equals MuJoCo's Jacobians, b_v = -J̇v the finite differences of them."""
    # A release test that drops nothing: b_v is its alone.
    bench = Bench(Scenario(actuation=Actuation(torque_limit=1e9, release_force=1e12)), general=True)
    for q, v in states(60, 21, speed=5.0):
        bench.tick(q, v)
        A, b = rows_of(bench.active, dynamics(q, v), jdot_v(q, v))
        m = bench.c["tick"]["rows"]
        np.testing.assert_allclose(bench.c["work"]["A"][:m], A, atol=1e-13)
        np.testing.assert_allclose(bench.c["work"]["b_v"][:m], b, atol=1e-6 * max(1.0, np.abs(b).max(initial=0.0)))


def released(d, jv, q, Q_d, pull: float):
    """The release test as the notes on the thesis word it, with a pseudo-inverse: (active, clear).

    Clear: no rank and no force was so close to a decision that rounding may take the other one.
    """
    active = [*(d.height < 0.001), -q[4] < 0.02, -q[7] < 0.02]
    R_1 = np.linalg.inv(np.linalg.cholesky(d.M).T)
    clear = True
    while True:
        A, b = rows_of(active, d, jv)
        clear &= well_ranked(d.M, A)
        if not len(A):
            return active, clear
        C = A @ R_1
        inverse = np.linalg.pinv(C, rcond=1e-4)
        a = R_1 @ (R_1.T @ (Q_d - d.h))
        force = inverse.T @ (inverse @ (b - A @ a))  # (C Cᵀ)⁺ (b - A a)
        points = [i for i in range(4) if active[i]]
        normal = {i: force[2 * n] for n, i in enumerate(points)}
        clear &= all(abs(f + pull) > 1e-3 * (1.0 + abs(f)) for f in normal.values())
        hardest = min(normal, key=lambda i: normal[i], default=None)
        if hardest is None or normal[hardest] >= -pull:
            return active, clear
        active[hardest] = 0


def compare(bench: Bench, states, slope: float = 0.0) -> tuple[int, int]:
    """Checks active sets and torques of the compiled tick; returns (compared, of which something was released)."""
    compared = dropped = 0
    pull = bench.run.scenario.actuation.release_force
    for q, v in states:
        u = bench.tick(q, v)
        d, jv = dynamics(q, v, slope), jdot_v(q, v)
        active, clear = released(d, jv, q, bench.c["tick"]["Q_d"], pull)
        if not clear:
            continue
        assert bench.active == tuple(active)
        oracle = torques(d.M, rows_of(active, d, jv)[0], bench.c["tick"]["Q_d"], 1e-4)
        np.testing.assert_allclose(u, oracle, atol=1e-9 * max(1.0, np.abs(oracle).max()))
        compared += 1
        dropped += (np.array(active[:4]) != (d.height < 0.001)).any()
    return compared, dropped


@pytest.mark.parametrize("general", [False, True])
def test_release_at_random_states(general):
    compared, dropped = compare(Bench(Scenario(actuation=FREE), general), states(250, 22))
    assert compared > 100
    assert 20 < dropped < compared - 20


@pytest.mark.parametrize("general", [False, True])
def test_release_with_another_pull_and_a_slope(general):
    act = Actuation(torque_limit=1e9, release_force=20.0)
    bench = Bench(Scenario(actuation=act, ground=Ground(slope=5.0)), general)
    compared, dropped = compare(bench, states(100, 23), slope=5.0)
    assert compared > 40
    assert dropped > 10


def test_release_in_a_walk():
    """States that a walk really visits: every tick decides again which points are constraints."""
    walk = simulate(Plan(Scenario(duration=1.5, start=Start(posture="heel_toe"))).run(0))
    assert walk.end == "completed"
    bench = Bench(Scenario(actuation=FREE))
    ticks = range(0, len(walk), 7)
    compared, dropped = compare(bench, ((walk.q[k].copy(), walk.v[k].copy()) for k in ticks))
    assert compared > 100
    assert dropped > 20


def test_knees_are_never_released():
    bench = Bench(Scenario(actuation=FREE))
    seen = 0
    for q, v in states(60, 24):
        bench.tick(q, v)
        assert bench.active[4:] == (-q[4] < 0.02, -q[7] < 0.02)
        seen += sum(bench.active[4:])
    assert seen > 10
