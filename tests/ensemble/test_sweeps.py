"""Sweeps, draws and thresholds: what varies, what is drawn, and when a threshold counts."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.statistics import wilson
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.ensemble.results import by_point, goal_at, threshold_words, thresholds
from biped.scenario.goals import Bound
from biped.scenario.keys import Scenario, Sensors, Simulation, Start, Truth
from biped.scenario.metrics import HEAD
from biped.scenario.randomise import Distribution, Randomise, Threshold
from biped.scenario.vary import ChangeOrigin, drawn, points_of, run_seed, with_values
from biped.scenario.world import Push

PUSHED = Scenario(duration=0.2, push=(Push(at=0.0, duration=0.1, force=(10.0, 0.0)),))


def swept(*rates: float, values=(50.0, 100.0, 150.0), runs=1000) -> tuple[Scenario, list[dict]]:
    scenario = Scenario(sweep={"push.0.force.0": values}, push=PUSHED.push, threshold=Threshold(rate=0.9))
    return scenario, [
        {"values": {"push.0.force.0": v}, "rate": r, "runs": runs, "interval": wilson(round(r * runs), runs)}
        for v, r in zip(values, rates, strict=True)
    ]


def test_points_are_all_combinations_and_change_the_scenario():
    scenario = Scenario(sweep={"ground.slope": (1.0, 2.0), "start.posture": ("flat", "single")})
    assert points_of(scenario) == [
        {"ground.slope": 1.0, "start.posture": "flat"}, {"ground.slope": 1.0, "start.posture": "single"},
        {"ground.slope": 2.0, "start.posture": "flat"}, {"ground.slope": 2.0, "start.posture": "single"},
    ]  # fmt: skip
    plan = Plan(scenario)
    assert len(plan) == 4
    assert [plan.run(i).scenario.ground.slope for i in range(4)] == [1.0, 1.0, 2.0, 2.0]


def test_runs_of_equal_number_share_their_seed_at_every_point():
    plan = Plan(Scenario(sweep={"ground.slope": (1.0, 2.0)}, randomise=Randomise(runs=3), start=Start(jitter=1e-3)))
    for number in range(3):
        here, there = plan.run(number), plan.run(3 + number)
        assert here.seed == there.seed == run_seed(0, number)
        np.testing.assert_array_equal(here.q, there.q)
    assert len({plan.run(i).seed for i in range(3)}) == 3


def test_a_lucky_pocket_is_no_threshold():
    scenario, points = swept(1.0, 0.5, 1.0)
    (up,) = thresholds(scenario, points)
    assert (up["holds_to"], up["fails_at"]) == (50.0, 100.0)
    scenario, points = swept(1.0, 0.9, 0.95)
    assert thresholds(scenario, points)[0]["holds_to"] == 150.0
    scenario, points = swept(0.8, 1.0, 1.0, values=(-50.0, 100.0, -150.0))
    up, down = thresholds(scenario, points)
    assert (up["holds_to"], up["fails_at"]) == (100.0, None)
    assert (down["holds_to"], down["fails_at"]) == (None, -50.0)
    assert "not even the smallest" in threshold_words(down)


def test_a_point_counts_the_runs_that_did_what_is_expected():
    """A robot that has to stand does not fail for want of walking."""
    rows = [
        {"index": i, "walked": i == 3, "stood": i < 3, "sat": False, "fell": i > 3, "falls": i > 3, "doubtful": False,
         **dict.fromkeys(HEAD, 0.0)}
        for i in range(6)
    ]  # fmt: skip
    sweep = {"push.0.force.0": (10.0, 20.0)}
    for expected, goal, counts, holds in (
        ({"stood": Bound(min=1)}, "stood", [3, 0], 10.0),
        ({}, "walked", [0, 1], None),
    ):
        scenario = Scenario(sweep=sweep, push=PUSHED.push, randomise=Randomise(runs=3), expect=expected)
        points = by_point(scenario, rows)
        assert [goal_at(point) for point in points] == [(goal, count) for count in counts]
        assert [point["rate"] for point in points] == [count / 3 for count in counts]
        assert points[0]["interval"] == list(wilson(counts[0], 3))
        assert thresholds(scenario, points)[0]["holds_to"] == holds
    assert goal_at({"walked": 2}) == ("walked", 2)  # of older results


def test_a_threshold_says_what_its_runs_are_too_few_to_say():
    scenario, points = swept(1.0, 1.0, 0.0, runs=1000)
    assert threshold_words(thresholds(scenario, points)[0]).endswith("holds to 100, fails at 150")
    scenario, points = swept(1.0, 0.9, 0.0, runs=1000)
    (up,) = thresholds(scenario, points)
    assert (up["holds_to"], up["sure_to"], up["fails_at"], up["surely_fails"]) == (100.0, 50.0, 150.0, True)
    assert threshold_words(up).endswith("fails at 150; the 95 % intervals are sure of it to 50")
    scenario, points = swept(1.0, 1.0, 0.89, runs=1000)
    assert threshold_words(thresholds(scenario, points)[0]).endswith("sure of it to 100, and the failure may be chance")
    # 6 of 6 is [61 %, 100 %]; with n of n the lower bound is n / (n + 1.96²), which reaches 90 % at n = 35.
    scenario, points = swept(1.0, 1.0, 0.0, runs=6)
    words = threshold_words(thresholds(scenario, points)[0])
    assert words.endswith("fails at 150; too few runs to say: 6 at a point show 61% at most, 90% takes 35")
    assert "too few" not in threshold_words(thresholds(*swept(0.0, 0.0, 0.0, runs=6))[0]), "0 of 6 is enough to fail"
    assert thresholds(scenario, points[:2]) == [], "a point without runs has no rate"


def test_points_count_their_own_runs():
    scenario = Scenario(sweep={"ground.slope": (1.0, 2.0)}, randomise=Randomise(runs=2))
    rows = [
        dict.fromkeys(("speed", "cost_of_transport", "double_support"), float(i))
        | {"index": i, "fell": i == 3, "walked": i < 3}
        for i in range(4)
    ]
    from biped.scenario.metrics import METRICS

    full = [dict.fromkeys(METRICS, 0.0) | row for row in rows]
    first, second = by_point(scenario, full)
    assert (first["walked"], first["falls"], second["walked"], second["falls"]) == (2, 0, 1, 1)
    assert (first["speed"], second["speed"]) == (0.5, 2.0)  # means over the runs that walked


def test_draws_follow_their_distribution_and_their_own_stream():
    random = Randomise(draw={"ground.friction": Distribution(uniform=(0.5, 1.5)),
                             "push.0.force.0": Distribution(normal=(100.0, 10.0))})  # fmt: skip
    scenario = with_values(PUSHED, {}, ChangeOrigin("test"))
    from msgspec.structs import replace

    scenario = replace(scenario, randomise=random)
    draws = [drawn(scenario, i, run_seed(0, i)) for i in range(300)]
    friction = np.array([d["ground.friction"] for d in draws])
    force = np.array([d["push.0.force.0"] for d in draws])
    assert 0.5 <= friction.min() < 0.55
    assert 1.45 < friction.max() <= 1.5
    assert abs(force.mean() - 100.0) < 3.0
    assert abs(force.std() - 10.0) < 1.5
    more = replace(scenario, randomise=Randomise(draw={"ground.slope": Distribution(choice=(0.0, 1.0)), **random.draw}))
    assert drawn(more, 7, run_seed(0, 7))["ground.friction"] == draws[7]["ground.friction"]


def test_each_number_of_a_list_is_drawn_by_itself_and_a_grid_in_turn():
    scenario = Scenario(
        randomise=Randomise(
            draw={"truth.mass": Distribution(normal=(1.0, 0.1)), "ground.slope": Distribution(grid=(1.0, 2.0))}
        )
    )
    one, two = (drawn(scenario, i, run_seed(0, i)) for i in range(2))
    assert len(set(one["truth.mass"])) == 7
    assert (one["ground.slope"], two["ground.slope"]) == (1.0, 2.0)


def test_impossible_draws_are_refused():
    with pytest.raises(InputError, match=r"truth\.mass"):  # seven draws: one is negative in the first run
        Plan(Scenario(randomise=Randomise(draw={"truth.mass": Distribution(uniform=(-1.0, 1.0))})))


def test_a_different_truth_is_what_walks():
    factors = (1.1, 0.9, 1.2, 0.8, 1.0, 1.0, 1.05)
    run = Plan(Scenario(duration=0.05, truth=Truth(mass=factors, length=factors))).run(0)
    tree = campaign.simulate(run).tree
    np.testing.assert_allclose(tree.mass, np.array(factors) * [50.85, 7.5, 3.4875, 1.0875, 7.5, 3.4875, 1.0875])
    assert tree.joint[2, 1] == pytest.approx(-0.441 * 0.9)
    assert tree.inertia[1] == pytest.approx(0.1521750619 * 0.9**3)


def test_sensors_delay_quantise_and_leave_the_log_true():
    quiet = Scenario(duration=0.1, simulation=Simulation(), start=Start(posture="heel_toe"))
    from msgspec.structs import replace

    noisy = replace(quiet, sensors=Sensors(angle_noise=1e-3, delay=0.002, quantisation=1e-4))
    clean, seen = (campaign.simulate(Plan(s).run(0)) for s in (quiet, noisy))
    np.testing.assert_array_equal(clean.q[0], seen.q[0])  # the start itself is the same, and is logged truly
    assert np.abs(clean.u - seen.u).max() > 1e-3  # but the controller saw something else

    from biped.control.planar.senses import PlanarSensors as Instrument

    q, v = np.zeros(9), np.zeros(9)
    run = Plan(replace(quiet, sensors=Sensors(delay=0.002, quantisation=0.5))).run(0)
    instrument = Instrument(run, q, v, 10)
    measured = []
    for k in range(6):
        q[:] = k * 0.3
        instrument.measure(k)
        measured.append(instrument.q[5])
    np.testing.assert_allclose(measured, [0.0, 0.0, 0.0, 0.5, 0.5, 1.0])


def test_lagging_torques_follow_as_a_first_order_system():
    from msgspec.structs import replace

    direct = Scenario(duration=0.02, start=Start(posture="heel_toe"))
    lagging = replace(direct, actuation=replace(direct.actuation, lag=0.01))
    u, slow = (campaign.simulate(Plan(s).run(0)).u for s in (direct, lagging))
    np.testing.assert_allclose(slow[0], u[0] * (1.0 - np.exp(-0.1)), rtol=1e-12)
