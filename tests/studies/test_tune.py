"""The tuner: its space keeps a gait's structure, its results do not depend on luck, jobs or interruptions."""

from __future__ import annotations

import json
import math
import sys

import msgspec
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.ensemble.plan import Plan
from biped.scenario.gains import GAINS, Gains
from biped.scenario.gait import read_gains
from biped.scenario.reading import read_scenario
from biped.studies.tune.evaluate import Outcome, Study, workers
from biped.studies.tune.report import gait_of, gait_text
from biped.studies.tune.search import Search
from biped.studies.tune.space import Space

TEXT = """
controller = "fast"
seed = 5
duration = 0.5

[start]
jitter = 0.002

[tune]
duration = 0.3
generations = 3
population = 4
recheck = 2
checks = 1
unseen = 2
finalists = 2

[tune.weights]
cost_of_transport = 0.1

[tune.conditions.level]
runs = 2
speed = 0.8

[tune.conditions.uphill]
runs = 1
set.ground.slope = 5.0
"""


@pytest.fixture
def scenario_file(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def study_of(path, *changes):
    return Study(read_scenario(str(path), list(changes)))


def tuned(path, out, *more):
    assert main(["tune", str(path), "--out", str(out), "--jobs", "1", *more]) == 0
    return (out / "gait.toml").read_text(encoding="utf-8"), (out / "runs.jsonl").read_text(encoding="utf-8")


def test_space_keeps_structure(scenario_file):
    study = study_of(scenario_file)
    space = Space(study.scenario, study.gains)
    names = {axis.name for axis in space.axes}
    assert not names & {"k_d2.3", "k_d3.2"}  # zero springs stay zero
    assert "theta_l.3" not in names  # a thigh angle without a spring means nothing
    assert space.candidate(np.zeros(len(space.axes))).gains == study.gains
    rng = np.random.default_rng(1)
    for _ in range(20):
        gains = space.candidate(rng.normal(0.0, 10.0, len(space.axes))).gains
        for name in GAINS:
            for new, old in zip(np.atleast_1d(getattr(gains, name)), np.atleast_1d(getattr(study.gains, name)),
                                strict=True):  # fmt: skip
                if name.startswith("theta"):
                    assert abs(new - old) <= 20.0 + 1e-2
                elif old == 0.0:
                    assert new == 0.0
                else:
                    assert 0.2 * 0.999 <= new / old <= 5.0 * 1.001


def test_keys_vary_within_their_range(scenario_file):
    change = 'tune.keys={"actuation.release_force"={min=50.0,max=400.0,scale="log"},"sensing.ahead"={min=0.0,max=0.2}}'
    study = study_of(scenario_file, change, 'tune.gains=["theta_b"]')
    space = Space(study.scenario, study.gains)
    assert [axis.name for axis in space.axes] == ["theta_b", "actuation.release_force", "sensing.ahead"]
    assert dict(space.candidate([0.0, 0.0, 0.0]).keys) == {"actuation.release_force": 150.0, "sensing.ahead": 0.1}
    assert dict(space.candidate([0.0, -9.0, 9.0]).keys) == {"actuation.release_force": 50.0, "sensing.ahead": 0.2}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('tune.gains=["k_d5"]', ["tune.gains", "k_d5", "k_d"]),
        ('tune.gains=["k_d2.7"]', ["tune.gains", "k_d2.7"]),
        ('tune.gains=["k_d3.2"]', ["zero gains stay zero"]),
        ('tune.keys={"sensing.ahed"={min=0.0,max=1.0}}', ["sensing.ahed", "did you mean 'ahead'"]),
        ('tune.keys={"actuation.mode"={min=0.0,max=1.0}}', ["actuation.mode", "one number"]),
        ('tune.keys={"sensing.ahead"={min=0.2,max=1.0}}', ["sensing.ahead", "0.1"]),
        ('tune.keys={"sensing.ahead"={min=0.0,max=1.0,scale="log"}}', ["sensing.ahead", "log"]),
        ("tune.conditions.level.set.ground.slop=1.0", ["tune.conditions.level.set", "slop", "slope"]),
        ("tune.conditions.level.set.gains.k_d1=1.0", ["tune.conditions.level.set", "gains"]),
    ],
)
def test_mistakes_are_named(scenario_file, change, words):
    def space():
        study = study_of(scenario_file, change)
        return Space(study.scenario, study.gains)

    with pytest.raises(InputError) as error:
        space()
    for word in words:
        assert word in str(error.value)


def test_scenario_without_tune_or_conditions(tmp_path):
    with pytest.raises(InputError, match="tune: missing"):
        Study(read_scenario("level_fast"))
    (tmp_path / "none.toml").write_text("[tune]\ngenerations = 2\n", encoding="utf-8")
    with pytest.raises(InputError, match="conditions: missing"):
        Study(read_scenario(str(tmp_path / "none.toml")))


def test_without_cma_the_extra_is_named(scenario_file, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "cma", None)
    assert main(["tune", str(scenario_file), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 2
    assert "biped[tune]" in capsys.readouterr().err


def test_same_scenario_same_gait_for_any_number_of_jobs(scenario_file, tmp_path, capsys):
    gait, journal = tuned(scenario_file, tmp_path / "a")
    np.random.standard_normal(3)  # noqa: NPY002  # the search has its own stream: the global one must not matter
    assert main(["tune", str(scenario_file), "--out", str(tmp_path / "b"), "--jobs", "2", "--json"]) == 0
    assert (tmp_path / "b" / "gait.toml").read_text(encoding="utf-8") == gait
    assert (tmp_path / "b" / "runs.jsonl").read_text(encoding="utf-8") == journal
    result = json.loads(capsys.readouterr().out.partition("\n{")[2].join(["{", ""]))
    assert result["conditions"]["level"]["runs"] == 2
    assert (tmp_path / "b" / "convergence.png").stat().st_size > 1000
    assert len(journal.splitlines()) == 1 + 3  # what it is about, and three generations


def test_killed_and_continued_equals_undisturbed(scenario_file, tmp_path, capsys):
    gait, journal = tuned(scenario_file, tmp_path / "whole")
    cut = tmp_path / "cut"
    cut.mkdir()
    (cut / "scenario.toml").write_bytes((tmp_path / "whole" / "scenario.toml").read_bytes())
    # Killed while the second generation's line was being written.
    (cut / "runs.jsonl").write_text("\n".join(journal.splitlines()[:2]) + '\n{"index": 2, "cos', encoding="utf-8")
    again, continued = tuned(scenario_file, cut)
    assert again == gait
    assert [line for line in continued.splitlines() if line.endswith("}")] == journal.splitlines()


def test_gait_file_is_the_gait_that_was_scored(scenario_file, tmp_path, capsys):
    gait, _ = tuned(scenario_file, tmp_path / "out")
    assert "seeds never used" in gait
    assert "'fast'" in gait
    read = read_gains(tmp_path / "out" / "gait.toml", Gains())
    assert read == gait_of(gait)
    assert read != Plan(read_scenario("level_fast")).run(0).gains
    # It can be walked with at once.
    assert Plan(read_scenario("level_fast", [f"controller={tmp_path / 'out' / 'gait.toml'}"])).run(0).gains == read


def test_settings_that_are_tables_are_written_too(scenario_file, tmp_path, capsys):
    more = ["--set", "actuation.contacts=pushing", "--set", "sensing.ahead=0.15"]
    more += ["--set", 'tune.keys={"actuation.pushing.approach"={min=0.01,max=0.05,scale="log"}}']
    gait, _ = tuned(scenario_file, tmp_path / "out", *more)
    scenario = read_scenario("level_fast", [f"controller={tmp_path / 'out' / 'gait.toml'}"])
    assert scenario.actuation.contacts == "pushing"
    assert scenario.sensing.ahead == 0.15
    assert f"approach = {scenario.actuation.pushing.approach}" in gait
    assert scenario.actuation.pushing.approach != 0.02  # it was searched for


def test_no_two_purposes_share_a_seed(scenario_file):
    study = study_of(scenario_file)
    seeds = [study.seed("generation", i) for i in range(50)] + [study.seed("recheck", i) for i in range(50)]
    seeds += [study.seed("final"), study.seed("unseen")]
    assert len(set(seeds)) == len(seeds)
    runs = {run_of(study, seed, i).seed for seed in seeds[:5] for i in range(2)}
    assert len(runs) == 10


def run_of(study, seed, number):
    candidate = Space(study.scenario, study.gains).candidate([0.0] * 31)
    task = study.tasks(candidate, seed, True, {"level": range(number, number + 1)})[0]
    return study._run(task)


def landscape(study, target):
    """Runs whose cost is the squared distance of ln k_d1 and of theta_b from a target, plus noise of the seed."""

    def evaluate(tasks):
        out = []
        for task in tasks:
            gains = task.candidate.gains
            noise = np.random.default_rng([task.seed, task.number]).normal(0.0, 0.01)
            cost = math.log(gains.k_d1 / target[0]) ** 2 + ((gains.theta_b - target[1]) / 20.0) ** 2 + noise
            out.append(Outcome(cost, True, 0.8, 0.2))
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
    candidate = Space(study.scenario, study.gains).candidate([0.0])
    with workers(study, 1) as evaluate:
        fallen = evaluate(study.tasks(candidate, 1, True, {"uphill": range(2)}))
    assert all(not o.walked and 0.5 <= o.cost <= 1.0 for o in fallen)
    upright = study_of(scenario_file, "tune.weights.speed=1000.0", "duration=3.0", "gains.theta_b=78.0")
    candidate = Space(upright.scenario, upright.gains).candidate([0.0] * 31)
    with workers(upright, 1) as evaluate:
        walked = [o for o in evaluate(upright.tasks(candidate, 3, True, {"level": range(3)})) if o.walked]
    assert walked
    assert all(o.cost <= 0.5 for o in walked)


def test_tuning_scenarios_are_sound():
    from biped.base.files import names

    tuning = [name for name in names("scenarios") if name.startswith("tune/")]
    assert tuning
    for name in tuning:
        study = Study(read_scenario(name))
        assert Space(study.scenario, study.gains).axes


FAMILY = """
extends = "fast"
[[speeds]]
at = 1.0
theta_b = 70.0
k_d2 = [900.0, 70.0, 70.0, 0.0]
[[speeds]]
at = 0.5
theta_b = 80.0
k_d2 = [600.0, 70.0, 70.0, 0.0]
"""


def test_family_interpolates_between_speeds(tmp_path):
    path = tmp_path / "family.toml"
    path.write_text(FAMILY, encoding="utf-8")
    fast = read_gains(path, Gains())
    assert fast.theta_b == 87.5  # without a speed the tables have no effect
    gains = read_gains(path, Gains(speed=0.6))
    assert gains.theta_b == pytest.approx(78.0)
    assert gains.k_d2 == pytest.approx((660.0, 70.0, 70.0, 0.0))
    assert gains.k_d1 == fast.k_d1
    assert read_gains(path, Gains(speed=0.6, theta_b=75.0)).theta_b == 75.0
    assert read_gains(path, Gains(speed=1.0)).theta_b == 70.0


@pytest.mark.parametrize(
    ("text", "speed", "words"),
    [
        (FAMILY, 1.2, ["gains.speed", "0.5 … 1 m/s", "1.2"]),
        ('extends = "fast"', 0.8, ["at least two", "gains.speed = 0.8"]),
        (FAMILY.replace("at = 0.5", "at = 1.0"), 1.0, ["different speeds"]),
        (FAMILY.replace("theta_b = 80.0", ""), 0.7, ["theta_b at 0.5"]),
        (FAMILY.replace("at = 0.5", ""), 0.7, ["speeds", "at"]),
    ],
)
def test_family_mistakes_are_named(tmp_path, text, speed, words):
    path = tmp_path / "family.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_gains(path, Gains(speed=speed))
    for word in [*words, "family.toml"]:
        assert word in str(error.value)


def test_family_is_swept_like_any_key(tmp_path):
    path = tmp_path / "family.toml"
    path.write_text(FAMILY, encoding="utf-8")
    scenario = read_scenario("level_fast", [f"controller={path}", 'sweep={"gains.speed"=[0.5,1.0]}'])
    plan = Plan(scenario)
    assert [plan.run(i).gains.theta_b for i in range(2)] == [80.0, 70.0]
    assert msgspec.structs.replace(plan.run(0).gains, theta_b=0.0) != plan.run(1).gains


@pytest.mark.parametrize(
    ("name", "changes", "speed"),
    [
        ("robust/own", [], 0.79),
        ("robust/own", ["gains.speed=0.6"], 0.6),
        ("robust/own", ["gains.speed=1.0"], 1.0),
        ("robust/model_error", [], 0.79),
        ("robust/efficient", ["sweep={}"], 0.77),
    ],
)
def test_shipped_gaits_walk_at_their_speed(name, changes, speed):
    from biped.ensemble.campaign import run_one

    scenario = read_scenario(name, [*changes, "duration=8.0"])
    _, row = run_one(Plan(scenario), 0)
    assert row.walked
    assert row.speed == pytest.approx(speed, rel=0.05)


def test_upright_with_every_contact_kept_it_stands_through_a_push():
    from biped.ensemble.campaign import run_one

    _, row = run_one(Plan(read_scenario("robust/stand", ["duration=5.0"])), 0)
    assert not row.fell
    assert abs(row.distance) < 0.1


def test_it_stops_at_any_moment_of_a_stride_and_stands():
    """About 15 of 16 do (docs/robust.md); the first change slows them down, the last brings the torso upright."""
    from biped.ensemble.campaign import run_one

    plan = Plan(read_scenario("robust/walk_to_stand"))
    rows = [run_one(plan, i)[1] for i in range(8)]
    assert sum(row.stood for row in rows) >= 6
    assert all(row.distance > 3.0 for row in rows), "they walked first"
    assert not any(row.stood for row in [run_one(Plan(read_scenario("robust/own")), 0)[1]])


STAND = """
extends = "tune/stand"
duration = 1.0
[start]
jitter = 0.0
[tune]
duration = 1.0
[tune.conditions.quiet]
set.randomise.draw."start.posture" = { grid = ["flat"] }
[tune.conditions.pushed.set]
push = [{ at = 0.3, duration = 0.2, force = [2000.0, 0.0] }]
randomise.draw."push.0.force.0" = { uniform = [2000.0, 2100.0] }
"""


def test_who_should_stand_is_paid_for_standing_and_not_for_distance(tmp_path):
    path = tmp_path / "stand.toml"
    path.write_text(STAND, encoding="utf-8")
    study = study_of(path, "window.start=0.5", "window.end=1.0", "tune.weights.progress=1.0")
    candidate = Space(study.scenario, study.gains).candidate([0.0] * len(Space(study.scenario, study.gains).axes))
    with workers(study, 1) as evaluate:
        quiet = evaluate(study.tasks(candidate, 1, True, {"quiet": range(1)}))[0]
        pushed = evaluate(study.tasks(candidate, 1, True, {"pushed": range(1)}))[0]
    assert quiet.walked, "it reached its goal"
    assert quiet.cost <= 0.5
    assert not pushed.walked
    assert pushed.cost > 0.5
    walking = study_of(path, "window.start=0.5", "window.end=1.0", "tune.conditions.quiet.goal=walked")
    with workers(walking, 1) as evaluate:
        assert not evaluate(walking.tasks(candidate, 1, True, {"quiet": range(1)}))[0].walked
