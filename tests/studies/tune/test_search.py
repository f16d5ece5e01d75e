"""A search: what a candidate costs, on which seeds, and whether it finds what is known."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from biped.scenario.goals import Tune, Weights
from biped.studies.tune import gait_text
from biped.studies.tune.evaluate import GainOutcome, below, earned, workers
from biped.studies.tune.search import Search
from biped.studies.tune.search_space import SearchSpace
from tests.studies.tune.small import study_of


def test_no_two_purposes_share_a_seed(scenario_file):
    study = study_of(scenario_file)
    seeds = [study.seed("generation", i) for i in range(50)] + [study.seed("recheck", i) for i in range(50)]
    seeds += [study.seed("final"), study.seed("unseen")]
    assert len(set(seeds)) == len(seeds)
    runs = {run_of(study, seed, i).seed for seed in seeds[:5] for i in range(2)}
    assert len(runs) == 10


def run_of(study, seed, number):
    candidate = SearchSpace(study.scenario, study.gains).candidate([0.0] * 31)
    task = study.tasks(candidate, seed, True, {"level": range(number, number + 1)})[0]
    return study._run(task)


def test_robots_of_earlier_generations_are_not_kept(scenario_file):
    """Every plan holds a robot with its models: a search of a hundred generations would fill the memory with them."""
    study = study_of(scenario_file)
    candidate = SearchSpace(study.scenario, study.gains).candidate([0.0] * 31)
    kept = []
    for generation in range(3):
        seed = study.seed("generation", generation)
        for _ in range(2):
            for task in study.tasks(candidate, seed, False, {"level": range(2), "uphill": range(1)}):
                study._run(task)
        kept.append(dict(study._plans))
    assert [len(plans) for plans in kept] == [2, 2, 2], "one of each condition, whatever came before"
    assert not kept[0].keys() & kept[2].keys()


def landscape(study, target):
    """Runs whose cost is the squared distance of ln k_d1 and of theta_b from a target, plus noise of the seed."""

    def evaluate(tasks):
        out = []
        for task in tasks:
            gains = task.candidate.gains
            noise = np.random.default_rng([task.seed, task.number]).normal(0.0, 0.01)
            cost = math.log(gains.k_d1 / target[0]) ** 2 + ((gains.theta_b - target[1]) / 20.0) ** 2 + noise
            out.append(GainOutcome(cost, True, 0.8, 0.2))
        return out

    return evaluate


def test_search_finds_a_known_optimum_through_noise(scenario_file):
    study = study_of(scenario_file, 'tune.gains=["k_d1","theta_b"]', "tune.generations=40", "tune.population=8")
    search = Search(study, landscape(study, (600.0, 78.0)))
    for _ in range(40):
        search.generation()
    found = search.finish()
    gains = found.candidate.gains
    assert gains.k_d1 == pytest.approx(600.0, rel=0.15)
    assert gains.theta_b == pytest.approx(78.0, abs=3.0)
    assert found.cost < 0.1 * found.start_cost
    assert "walked" in gait_text("x", search, found)


def test_given_up_points_rank_behind(scenario_file):
    study = study_of(scenario_file, "tune.population=10", "tune.conditions.level.runs=9", "tune.keep=0.4")
    search = Search(study, landscape(study, (600.0, 78.0)))
    seen = []
    evaluate = search.evaluate
    search.evaluate = lambda tasks: seen.append(len(tasks)) or evaluate(tasks)
    record = search.generation()
    assert seen == [10 * (3 + 1), 4 * 6]  # a third of nine runs and one of one for all, the rest for four
    costs = sorted(record["costs"])
    assert len(set(costs)) == 10
    assert record["runs"] == sum(seen)


def test_a_walker_never_costs_more_than_a_faller(scenario_file):
    study = study_of(scenario_file, "tune.weights.speed=1000.0", "tune.gains=['theta_b']", "fall.tilt=5.0")
    candidate = SearchSpace(study.scenario, study.gains).candidate([0.0])
    with workers(study, 1) as evaluate:
        fallen = evaluate(study.tasks(candidate, 1, True, {"uphill": range(2)}))
    assert all(not o.walked and 0.5 <= o.cost <= 1.0 for o in fallen)
    upright = study_of(scenario_file, "tune.weights.speed=1000.0", "duration=3.0", "gains.theta_b=78.0")
    candidate = SearchSpace(upright.scenario, upright.gains).candidate([0.0] * 31)
    with workers(upright, 1) as evaluate:
        walked = [o for o in evaluate(upright.tasks(candidate, 3, True, {"level": range(3)})) if o.walked]
    assert walked
    assert all(o.cost <= 0.5 for o in walked)


def test_of_two_walks_far_from_what_is_wanted_the_better_one_costs_less():
    costs = [below(cost, 0.5) for cost in (0.0, 0.1, 0.25, 0.25 + 1e-9, 0.5, 1.0, 10.0, 1e3, math.inf)]
    assert costs[:3] == [0.0, 0.1, 0.25]
    assert costs == sorted(set(costs))
    assert costs[3] - costs[2] == pytest.approx(1e-9)
    assert costs[-1] == 0.5


def test_what_a_walker_lacks_of_a_floor_costs_like_what_it_exceeds_of_a_limit(scenario_file):
    changes = ("duration=3.0", "gains.theta_b=78.0", "tune.conditions.level.speed=0.8", "tune.weights.speed=0.0")
    costs = []
    for more in (
        (),
        ("tune.floors.torso_lean=24.0",),
        ("tune.limits.torso_lean=4.0",),
        ("tune.limits.torso_lean=4.0", "tune.conditions.level.limits={}"),
        ("tune.floors.torso_lean=24.0", "tune.conditions.level.floors={}"),
    ):
        study = study_of(scenario_file, *changes, "tune.weights.excess=0.01", *more)
        candidate = SearchSpace(study.scenario, study.gains).candidate([0.0] * 31)
        with workers(study, 1) as evaluate:
            one = evaluate(study.tasks(candidate, 3, True, {"level": range(1)}))[0]
        assert one.walked
        costs.append(one.cost)
    lean = 24.0 * (1.0 - (costs[1] - costs[0]) / 0.01)
    assert 4.0 < lean < 24.0
    assert costs[3:] == [costs[0], costs[0]]
    assert costs[2] - costs[0] == pytest.approx(0.01 * (lean / 4.0 - 1.0))


STAND = """
extends = "tune/stand"
duration = 1.5
[start]
jitter = 0.0
[tune]
duration = 1.5
[tune.conditions.quiet]
set.randomise.draw."start.posture" = { grid = ["flat"] }
[tune.conditions.pushed.set]
push = [{ at = 0.3, duration = 0.2, force = [2000.0, 0.0] }]
randomise.draw."push.0.force.0" = { uniform = [2000.0, 2100.0] }
"""


def test_who_should_stand_is_paid_for_standing_and_not_for_distance(tmp_path):
    path = tmp_path / "stand.toml"
    path.write_text(STAND, encoding="utf-8")
    study = study_of(path, "window.start=0.5", "window.end=1.5", "tune.weights.progress=1.0")
    candidate = SearchSpace(study.scenario, study.gains).candidate(
        [0.0] * len(SearchSpace(study.scenario, study.gains).axes)
    )
    with workers(study, 1) as evaluate:
        quiet = evaluate(study.tasks(candidate, 1, True, {"quiet": range(1)}))[0]
        pushed = evaluate(study.tasks(candidate, 1, True, {"pushed": range(1)}))[0]
    assert quiet.walked, "it reached its goal"
    assert quiet.cost <= 0.5
    assert not pushed.walked
    assert pushed.cost > 0.5
    walking = study_of(path, "window.start=0.5", "window.end=1.5", "tune.conditions.quiet.goal=walked")
    with workers(walking, 1) as evaluate:
        assert not evaluate(walking.tasks(candidate, 1, True, {"quiet": range(1)}))[0].walked


FALL = """
extends = "tune/any"
controller = "any/short"
duration = 2.5
[start]
jitter = 0.0
[randomise.draw]
"start.posture" = { grid = ["single"] }
[tune]
weights = { progress = 1.0 }
"""


def test_a_fall_forward_is_no_walk_at_a_brisk_pace(tmp_path):
    """H1 falls after 1.3 s and 0.33 m, which is further than the slowest walk comes in 2.5 s: 0.25 m."""
    path = tmp_path / "fall.toml"
    path.write_text(FALL, encoding="utf-8")
    earned = []
    for pace in 0.1, 0.5, 2.0:
        study = study_of(path, f"tune.pace={pace}")
        space = SearchSpace(study.scenario, study.gains)
        candidate = space.candidate([0.0] * len(space.axes))
        with workers(study, 1) as evaluate:
            (outcome,) = evaluate(study.tasks(candidate, 1, True, {"level": range(1)}))
        assert not outcome.walked
        earned.append(2.0 * (1.0 - outcome.cost))
    assert earned[0] == 1.0
    assert 0.2 < earned[1] < 0.4
    assert earned[2] == pytest.approx(0.25 * earned[1])


@pytest.mark.parametrize(("strayed", "steps", "still"), [(0.05, 0, 1.0), (0.2, 0, 0.5), (0.05, 1, 0.5), (0.4, 4, 0.05),
                                                         (math.nan, 0, 0.0)])  # fmt: skip
def test_who_stays_up_but_does_not_stand_still_earns_by_stillness(strayed, steps, still):
    """A robot that marches on the spot for the whole run, on either scale."""
    numbers = {"time": 10.0, "strayed": strayed, "steps": steps, "distance": 0.0, "diverged": False}
    run: Any = SimpleNamespace(scenario=SimpleNamespace(duration=10.0))
    paid = [earned(numbers, Tune(weights=Weights(stillness=share)), run, "stood") for share in (0.0, 0.5)]
    assert paid == pytest.approx([1.0, 0.5 + 0.5 * still])


@pytest.mark.parametrize("goal", ["walked", "stood"])
def test_a_run_that_blew_up_earns_nothing_however_far_it_came(goal):
    numbers = {"time": 9.0, "strayed": 0.0, "steps": 0, "distance": 1e9, "diverged": True}
    run: Any = SimpleNamespace(scenario=SimpleNamespace(duration=10.0))
    assert earned(numbers, Tune(pace=0.5, weights=Weights(progress=0.6)), run, goal) == 0.0
