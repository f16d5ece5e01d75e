"""A search for a robot of which only the model file is known: which gait it begins at, and what it refuses."""

from __future__ import annotations

import json
import tomllib

import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.cli.main import main
from biped.ensemble.journal import installed
from biped.ensemble.plan import Plan
from biped.scenario.gains import MGL
from biped.scenario.reading import read_scenario
from biped.studies.tune import Tuned, robot
from biped.studies.tune.robot import ASSISTS, GAITS, PLACES, POSTURES, SCENARIO, _own, _Shipped, is_model, search_of
from biped.studies.tune.search import SearchResult, Tally
from biped.studies.tune.stages import studies


def test_a_model_file_is_told_from_a_scenario():
    assert is_model("robots/mine.xml")
    assert is_model("mine.urdf")
    assert not is_model("tune/any")
    assert not is_model("mine.toml")


def test_it_begins_at_the_gaits_that_come_furthest_with_joint_torques():
    path = str(locate("models", "h1", "model"))
    changes, trials = search_of(path, ["duration=0.3", "seed=5"], 1)
    assert [(one.assist, one.gait) for one in trials] == [(assist, gait) for assist in ASSISTS for gait in GAITS]
    for one in trials:
        assert len(one.times) == 3
        assert 0.0 < min(one.times) <= max(one.times) <= 0.3
    assert len({one.distances for one in trials}) > 4, "the gaits move it alike: the test would not see which is best"
    ranked = sorted((one for one in trials if one.assist == 0.0), key=lambda one: -max(one.earned))
    stages = changes.pop(5)
    # The leg of h1 is 0.87 m long, so that 0.3 √(g l) is 0.876 m/s.
    places = [(one.gait, POSTURES[one.earned.index(max(one.earned))]) for one in ranked[:PLACES]]
    begin = ", ".join(f'{{controller = "{gait}", posture = "{posture}"}}' for gait, posture in places)
    assert changes == [
        f'model="{path}"', f'controller="{places[0][0]}"', f"tune.begin=[{begin}]",
        'tune.postures=["heel_toe", "flat", "single"]', "tune.pace=0.876", "duration=0.3", "seed=5",
    ]  # fmt: skip
    s = read_scenario(SCENARIO, [stages, *(one for one in changes if not one.startswith("duration"))])
    assert s.model == "h1"
    assert s.seed == 5
    assert s.robot is not None
    assert s.tune is not None
    assert [(place.controller, place.posture) for place in s.tune.begin] == places
    parts = studies(s)
    assert [one.base.actuation.assist for one in parts] == [0.0] * 6
    assert [len(one.base.robot.rigid) for one in parts if one.base.robot] == [9, 9, 9, 0, 9, 0], "arms and waist"
    shipped = read_scenario(SCENARIO).tune
    assert shipped is not None
    assert [one.generations for one in s.tune.stages] == [one.generations for one in shipped.stages]


def test_who_comes_furthest_with_Q_d_itself_does_not_begin(monkeypatch):
    """A made-up robot: `any/short` earns 0.4 with joint torques, `any/long` 0.6 with Q_d and stays up longest."""
    earned = {(0.0, "any/short"): 0.4, (1.0, "any/long"): 0.6}
    times = {(0.0, "any/long"): 6.0}
    monkeypatch.setattr(
        _Shipped, "__call__", lambda self, case: (times.get(case[:2], 2.0), 1.0, earned.get(case[:2], 0.2))
    )
    changes, _ = search_of(str(locate("models", "h1", "model")), [], 1)
    s = read_scenario(SCENARIO, changes)
    assert s.controller == "any/short"
    assert s.tune is not None
    assert s.tune.begin[0].controller == "any/short"


@pytest.mark.parametrize(("posture", "more"), [
    (None, []), ("flat", ["start.posture=flat"]), ("flat", ["start={posture='flat'}"]),
])  # fmt: skip
def test_a_gait_that_the_user_names_is_the_only_one_tried(monkeypatch, posture, more):
    """And so is a posture."""
    monkeypatch.setattr(_Shipped, "__call__", lambda self, case: (2.0, 1.0, 0.5 if case[2] == "single" else 0.2))
    changes, trials = search_of(str(locate("models", "h1", "model")), ["controller=any/long", *more], 1)
    assert {one.gait for one in trials} == {"any/long"}
    s = read_scenario(SCENARIO, changes)
    assert s.tune is not None
    assert [(one.controller, one.posture) for one in s.tune.begin] == [("any/long", posture or "single")]


def test_nothing_pushes_or_tilts_a_robot_in_the_plane_to_the_side(monkeypatch):
    monkeypatch.setattr(_Shipped, "__call__", lambda self, case: (2.0, 1.0, 0.5))
    changes, _ = search_of(str(locate("models", "walker2d", "model")), ["controller=any/long"], 1)
    s = read_scenario(SCENARIO, changes)
    pushed = Plan(studies(s)[-1].condition("pushed", True))
    forces = [pushed.run_from(seed).scenario.push[0].force for seed in range(3)]
    assert [len(force) for force in forces] == [2, 2, 2]
    assert len(set(forces)) == 3
    with pytest.raises(InputError, match=r"expected \[forward, up\] N: model .* moves in the plane"):
        studies(read_scenario(SCENARIO, [one for one in changes if "push.0" not in one]))


def test_another_robot_cannot_take_the_place_of_the_one_that_is_named():
    with pytest.raises(InputError, match=r"model: expected no change of it: models/h1\.xml takes its place"):
        search_of("models/h1.xml", ["model=human3d"], 1)


def test_tests_are_made_with_changes_of_the_robot_however_they_are_written():
    robots = ["model=h1", "simulation.timestep=0.001", "simulation={control_rate=1000.0}", " truth = {armature=0.02}"]
    assert _own([*robots, "seed=3", "simulations=2", "tune={generations=3}"]) == robots


def test_a_trial_earns_what_the_search_pays_for_time_and_distance():
    path = str(locate("models", "h1", "model"))
    time, distance, earned = _Shipped((f'model="{path}"', "tune.pace=0.9"))((0.0, "any/sure", "flat"))
    assert 0.2 < time < 6.0
    assert earned == pytest.approx(0.4 * time / 6.0 + 0.6 * max(0.0, distance) / (0.9 * 6.0))


@pytest.mark.parametrize("gait", GAITS)
def test_shipped_gaits_are_in_units_of_their_walker(gait):
    assert Plan(read_scenario(SCENARIO, [f'controller="{gait}"'])).run(0).gains.unit == MGL


def test_what_the_law_is_not_for_is_refused_in_a_sentence(capsys):
    path, words = str(locate("models", "humanoid", "model")), "hangs on 4 joints"
    with pytest.raises(InputError, match=words):
        search_of(path, [], 1)
    assert main(["tune", path]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error


def test_from_a_model_file_to_a_page(tmp_path, monkeypatch, capsys):
    """One command: trials, a search, its gait, tests of the gait on the same robot, a walk to look at, one page."""
    monkeypatch.setattr(robot, "TESTS", "any/cells/push_left")
    small = "window.start = 2.0\n[tune]\ngenerations = 1\npopulation = 4\nchecks = 1\nunseen = 1\n"
    for to in robot.SEARCHES:
        text = f'extends = "tune/any_{to}"\nduration = 5.0\n{small}'
        (tmp_path / f"{to}.toml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(robot, "SEARCHES", {to: str(tmp_path / f"{to}.toml") for to in robot.SEARCHES})
    path, out = str(locate("models", "h1", "model")), tmp_path / "mine"
    argv = ["tune", path, "--set", "duration=0.3", "--set", "tune.population=4", "--set", "tune.checks=1", "--set",
            "tune.unseen=1", "--set", "tune.tries=1", "--set", "controller=any/quick", "--set",
            'tune.stages=[{generations=1,conditions=["level"]}]', "--set", "simulation.control_rate=250.0",
            "--jobs", "1", "--out", str(out), "--json"]  # fmt: skip
    assert main(argv) == 0
    found = json.loads(capsys.readouterr().out)
    assert [test["name"] for test in found["standard"]["tests"]] == ["any/cells/push_left"]
    assert found["standard"]["changes"] == [f'model="{path}"', "simulation.control_rate=250.0"]
    (tried,) = found["standard"]["standings"][0]["tried"]
    assert (tried["runs"], tried["reached"]) == (10, 0), "three tenths of a second teach no robot to walk"
    text = (out / "page.html").read_text(encoding="utf-8")
    assert "A walk for h1" in text
    assert "pushed left" in text
    walked = json.loads((out / "walk" / "result.json").read_bytes())
    assert walked["scenario"] == "any/cells/level"
    assert tomllib.loads((out / "walk" / "scenario.toml").read_text())["simulation"]["control_rate"] == 250.0
    assert (out / "walk" / "trajectory.npz").is_file()
    gaits = tomllib.loads((out / "walk.toml").read_text(encoding="utf-8"))
    assert gaits["extends"] == "gait.toml"
    for to in robot.SEARCHES:  # which is named if it is better than the human's, in one generation of runs that fall
        searched = json.loads((out / to / "result.json").read_bytes())
        better = searched["objective"] < searched["before"]
        assert (gaits.get("transitions", {}).get(to) == f"{to}/gait.toml") == better
    begun = tomllib.loads((out / "stop" / "scenario.toml").read_text(encoding="utf-8"))
    assert begun["controller"] == str((out / "walk.toml").resolve())
    assert sorted(found["elsewhere"]) == (["drake"] if installed("drake") else [])
    kept = (out / "tests" / "measured.json").read_bytes()
    assert main(argv) == 0, "it goes on where it was, and makes nothing again"
    assert (out / "tests" / "measured.json").read_bytes() == kept


@pytest.mark.parametrize("there", [True, False])
def test_other_engines_see_the_walk_where_they_are_installed(tmp_path, monkeypatch, there):
    asked = []

    def standard(gaits, tests, changes, jobs, out, progress, engines=()):
        asked.append((tests, out.name, list(engines)))
        return "table"

    monkeypatch.setattr(robot, "standard", standard)
    monkeypatch.setattr(robot, "run", lambda *_, **__: None)
    monkeypatch.setattr(robot, "installed", lambda library: "1.51" if there and library == "drake" else "")
    found = robot.verdict(tmp_path / "walk.toml", ["model=h1"], 1)
    assert asked[0] == (["any/cells/"], "tests", [])
    assert asked[1:] == ([(["any/cells/level"], "tests_in_drake", ["drake"])] if there else [])
    assert (list(found.elsewhere), found.absent) == ((["drake"], []) if there else ([], ["drake"]))


@pytest.mark.parametrize(("stops", "stands"), [(20, "stop/gait.toml"), (15, None)])
def test_who_stops_a_walk_stands_by_that_gait(tmp_path, monkeypatch, stops, stands):
    """Before the search for a start, which begins with a stand."""
    seen = []

    def tune(search, changes, jobs, out, *_, tell):
        seen.append(
            (search, tomllib.loads((tmp_path / "walk.toml").read_text(encoding="utf-8")).get("transitions", {}))
        )
        tallies = {"stops": Tally(20, 20, 0.0, 0.0), "pushed": Tally(stops, 20, 0.0, 0.0)}
        result = SearchResult(None, 1, 0.1, tallies, 0.5, tallies)  # type: ignore[arg-type]
        return Tuned(search, out, out / "gait.toml", result, {"change.0.after_landing": 0.1}, 1, 1.0, 1.0)

    monkeypatch.setattr(robot, "tune", tune)
    robot.with_transitions(tmp_path / "gait.toml", ["model=h1"], 1)
    assert [search for search, _ in seen] == ["tune/any_stop", "tune/any_start"]
    begun = seen[1][1]
    assert (begun["stop"], begun["stop_after_landing"], begun.get("stand")) == ("stop/gait.toml", 0.1, stands)


@pytest.mark.parametrize("edited", ["stop_after_landing = 0.2", "", "k_d1 = 3.0"])
def test_a_walk_that_was_edited_is_not_overwritten(tmp_path, edited):
    path, gait = tmp_path / "walk.toml", tmp_path / "gait.toml"
    robot._write_walk(path, gait, {})
    robot._write_walk(path, gait, {"stop": "stop/gait.toml", "stop_after_landing": 0.1})
    text = path.read_text(encoding="utf-8").replace("stop_after_landing = 0.1", edited)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="was edited; rename it"):
        robot._write_walk(path, gait, {})
    assert path.read_text(encoding="utf-8") == text


@pytest.mark.parametrize("argv", [["--search-only"], ["--without", "any/g1"], ["--stages", "4"]])
def test_what_is_asked_of_a_robots_search_is_refused_of_a_scenarios(capsys, argv):
    assert main(["tune", "tune/any", *argv]) == 2
    assert f"{argv[0]}: expected a robot's model file, got 'tune/any'" in capsys.readouterr().err


def test_a_robots_own_gait_and_later_stages_are_left_out():
    """How often a search finds a walk is told by searches that do not begin at the walk that was found before."""
    path = str(locate("models", "h1", "model"))
    changes, trials = search_of(path, ["duration=0.1"], 1, without=["any/h1", "any/sure"], stages=4)
    assert {one.gait for one in trials} == {*GAITS} - {"any/h1", "any/sure"}
    tune = read_scenario(SCENARIO, [one for one in changes if not one.startswith("duration")]).tune
    assert tune is not None
    assert len(tune.stages) == 4


@pytest.mark.parametrize(("argv", "words"), [
    (["--without", "any/h2"], "--without any/h2: expected a gait that is tried; did you mean 'any/h1'?"),
    (["--stages", "7"], "--stages 7: expected 1 … 6"),
])  # fmt: skip
def test_gaits_and_stages_that_are_not_there(capsys, argv, words):
    assert main(["tune", str(locate("models", "h1", "model")), *argv]) == 2
    assert words in capsys.readouterr().err
