"""The tests with gaits: what each is asked, in whose units; ensembles that are kept; the command and its errors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from biped.base.errors import InputError, RunError
from biped.cli.main import main
from biped.ensemble.campaign import simulate
from biped.robot.ground import GRAVITY
from biped.show.document import markdown
from biped.show.page import write_page
from biped.show.standing import document_of, lines_of
from biped.studies import standard as study
from biped.studies.entrants import entrant_of
from biped.studies.run import plan_of
from biped.studies.standard import standard, trials_of
from biped.studies.standard.search import TriedValue
from tests.cases import command

SHORT = """description = "A push, searched in a hurry"
duration = 3.0
start = { posture = "heel_toe", jitter = 0.002 }
window = { start = 1.0 }
push = [{ at = 1.5, duration = 0.2, force = [0.0, 0.0] }]
randomise.runs = 3
threshold.rate = 0.7
[standard]
title = "push"
key = "push.0.force.0"
of = "weight"
first = 0.05
step = 2.0
last = 4.05
resolution = 1.0
times = 0.2
unit = "N s"
goal = "walked"
shows = ["push_froude"]
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("short.toml").write_text(SHORT, encoding="utf-8")
    return tmp_path


def test_a_gait_in_space_from_command_to_table(tmp_path, capsys):
    sets = ["--set", "randomise.runs=1", "--set", "duration=1.0", "--set", "window.start=0.2", "--jobs", "1"]
    code, told = command(capsys, "standard", "human3d", "calm", "--test", "space_level", *sets,
                         "--out", str(tmp_path / "s"))  # fmt: skip
    assert code == 0
    (one, none) = told["standings"]
    assert none["tried"] == []
    assert {"heading", "drift", "step_width"} <= set(one["tried"][0]["numbers"])


def test_a_table_and_what_is_kept_of_it(here, capsys, monkeypatch):
    made = []
    run_plan = study.run_plan
    monkeypatch.setattr(study, "run_plan", lambda title, *rest: made.append(title) or run_plan(title, *rest))
    argv = ["standard", "robust", "--test", "short.toml", "--out", "found", "--jobs", "1"]
    code, found = command(capsys, *argv)
    assert code == 0
    (standing,) = found["standings"]
    tried = standing["tried"]
    assert standing["scale"] == pytest.approx(75.0 * GRAVITY, rel=1e-6)
    assert [one["value"] for one in tried] == sorted(one["value"] for one in tried)
    assert all(one["runs"] == 3 for one in tried)
    assert tried[-1]["reached"] == 0  # nobody withstands four times its weight
    assert len(made) == len(tried)
    assert json.loads(Path("found/standard.json").read_text()) == found
    again, same = command(capsys, *argv)
    assert (again, same) == (0, found)
    assert len(made) == len(tried)  # nothing was made twice
    assert main([*argv, "--set", "seed=5"]) == 2  # whose table would be lost
    assert "holds a table with other changes" in capsys.readouterr().err
    Path("found/standard.json").unlink()
    assert command(capsys, *argv, "--set", "seed=5")[0] == 0
    assert len(made) > len(tried)  # but another seed is another ensemble
    Path("found/standard.json").unlink()
    assert main(argv) == 0
    printed = capsys.readouterr().out
    assert "push [N s]" in printed
    assert "standard.json and standard.md in found/" in printed
    assert "| push \\[N s\\] |" in Path("found/standard.md").read_text(encoding="utf-8")


def test_an_interrupted_table_goes_on(here, monkeypatch):
    made = []

    def interrupted(title, plan, jobs, progress):
        made.append(title)
        if len(made) == 2:
            raise KeyboardInterrupt
        return run_plan(title, plan, jobs, progress)

    run_plan = study.run_plan
    monkeypatch.setattr(study, "run_plan", interrupted)
    with pytest.raises(KeyboardInterrupt):
        standard(["robust"], ["short.toml"], [], 1, Path("found"))
    first = list(made)
    standard(["robust"], ["short.toml"], [], 1, Path("found"))
    assert made[2] == first[1]  # the first ensemble was kept


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["nobody"], "GAIT: no controller 'nobody'"),
        (["robust", "robust"], "robust: expected each gait once"),
        (
            ["robust", "--test", "short.toml", "--set", "controller=whole"],
            "controller: expected no change of it: robust",
        ),
        (["robust", "--test", "level_normal"], "level_normal: not a standard test"),
        (["robust", "--test", "nothing"], "nothing"),
        (["robust", "--test", "short.toml", "--set", "duration=0.1"], "push[0].at"),
        (["robust", "--test", "short.toml", "--jobs", "0"], "--jobs 0: expected at least 1"),
        (["robust", "--test", "short.toml", "--out", "short.toml"], "--out short.toml: cannot be written"),
    ],
)
def test_bad_input(argv, said, here, capsys):
    assert main(["standard", *argv]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(("gait", "test", "changes", "said"), [
    ("slow", "short.toml", ["duration=2.0"], "holds a table with calm; expected a new folder"),
    ("calm", "other.toml", ["duration=2.0"], "holds a table with short; expected a new folder"),
    ("calm", "short.toml", [], "holds a table with other changes; expected a new folder"),
])  # fmt: skip
def test_a_table_that_the_new_one_would_not_contain_is_not_written_over(here, gait, test, changes, said):
    """Said before the first run."""
    Path("other.toml").write_text(SHORT, encoding="utf-8")
    Path("out").mkdir()
    table = {"gaits": ["calm"], "changes": ["duration=2.0"], "tests": [{"name": "short"}]}
    Path("out/standard.json").write_text(json.dumps(table), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        standard([gait], [test], changes, 1, Path("out"))
    assert json.loads(Path("out/standard.json").read_text(encoding="utf-8")) == table


def test_what_lies_in_the_folder_is_not_overwritten(here, capsys):
    Path("found").mkdir()
    Path("found/measured.json").write_text('{"a": 1}', encoding="utf-8")
    assert main(["standard", "robust", "--test", "short.toml", "--out", "found"]) == 2
    assert "not what biped standard keeps" in capsys.readouterr().err
    assert Path("found/measured.json").read_text(encoding="utf-8") == '{"a": 1}'


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("standard.step=0.0", "standard.step: expected steps"),
        ("standard.step=-1.0", "standard.step: expected steps"),
        ("standard.resolution=0.3", "standard.resolution: expected the step of 2 to be a whole number"),
        ("standard.resolution=1e-9", "standard.resolution: expected at most"),
        ("standard.shows=['sped']", "unknown metric 'sped'"),
        ("standard.goal=walk", "standard.goal: expected one of walked, stood"),
    ],
)
def test_impossible_tests(change, said, here):
    from biped.scenario.reading import read_scenario

    with pytest.raises(InputError, match=said.replace("[", r"\[")):
        read_scenario("short.toml", [change])


FOUND = {
    "gaits": ["a", "<b>"],
    "changes": ["model=robot"],
    "tests": [
        {"name": "x/push", "title": "push", "description": "pushed", "goal": "walked", "rate": 0.7,
         "key": "push.0.force.0", "of": "weight", "times": 0.2, "unit": "N s", "shows": ["push_froude"]},
        {"name": "x/level", "title": "level", "description": "", "goal": "walked", "rate": 0.7, "key": None, "of": "si",
         "times": 1.0, "unit": "", "shows": ["speed"]},
    ],
    "standings": [
        {"test": "x/push", "gait": "a", "scale": 100.0,
         "tried": [TriedValue(0.1, 10, 10, {"push_froude": 0.1})._asdict() | {"interval": [0.72, 1.0]},
                   TriedValue(0.3, 7, 10, {"push_froude": 0.3})._asdict() | {"interval": [0.4, 0.9]},
                   TriedValue(0.4, 2, 10, {"push_froude": None})._asdict() | {"interval": [0.06, 0.5]}],
         "limit": {"holds_to": 0.3, "sure_to": 0.1, "fails_at": 0.4, "surely_fails_at": 0.4}},
        {"test": "x/push", "gait": "<b>", "scale": 100.0,
         "tried": [TriedValue(0.1, 1, 10, {"push_froude": None})._asdict() | {"interval": [0.0, 0.4]}],
         "limit": {"holds_to": None, "sure_to": None, "fails_at": 0.1, "surely_fails_at": 0.1}},
        {"test": "x/level", "gait": "a", "scale": 1.0, "limit": None,
         "tried": [TriedValue(None, 9, 10, {"speed": 0.7})._asdict() | {"interval": [0.6, 1.0]}]},
        {"test": "x/level", "gait": "<b>", "scale": 1.0, "limit": None, "tried": []},
    ],
}  # fmt: skip


def test_words_of_a_table():
    push, level = FOUND["tests"]
    assert lines_of(push, FOUND["standings"][0]) == ["6", "(2 … 8)", "0.3 m g", "J/(m√(g l)) 0.3"]
    assert lines_of(push, FOUND["standings"][1]) == ["none", "1 of 10 at 2"]
    assert lines_of(level, FOUND["standings"][2]) == ["9 of 10"]
    assert lines_of(level, FOUND["standings"][3]) == ["–"]
    assert "\\<b\\>" in markdown(document_of(FOUND))


def test_what_is_shown_has_rows_of_its_own_and_what_is_missed_is_bold():
    assert "| – speed \\[m/s\\] | 0.7 | – |" in markdown(document_of(FOUND))
    expect = {"walked": {"words": ">= 95 %", "share": True, "min": 0.95, "max": None},
              "speed": {"words": "<= 0.6", "share": False, "min": None, "max": 0.6}}  # fmt: skip
    push, level = FOUND["tests"]
    text = markdown(document_of(FOUND | {"tests": [push, level | {"expect": expect}]}))
    assert "| test | wanted | a |" in text
    assert "| level | \\>= 95 % | **9 of 10** | – |" in text
    assert "| – speed \\[m/s\\] | \\<= 0.6 | **0.7** | – |" in text
    expect["walked"]["min"], expect["speed"]["max"] = 0.9, 0.7
    assert "**" not in markdown(document_of(FOUND | {"tests": [push, level | {"expect": expect}]}))


def test_a_table_says_which_runs_cannot_be_believed():
    push, level = FOUND["tests"]
    lines = lines_of(push, FOUND["standings"][1] | {"tried": [TriedValue(0.1, 1, 10, {}, 8)._asdict()]})
    assert lines == ["none", "1 of 10 at 2", "8 doubtful"]
    one = TriedValue(None, 0, 10, {"speed": 0.7}, 10)._asdict()
    assert lines_of(level, FOUND["standings"][2] | {"tried": [one]}) == ["0 of 10", "10 doubtful"]
    one = TriedValue(None, 4, 10, {"speed": 0.7}, 0, 1)._asdict()  # five were as slow as their command does not allow
    assert lines_of(level, FOUND["standings"][2] | {"tried": [one]}) == ["4 of 10", "1 fell"]
    one = TriedValue(None, 4, 10, {"speed": 0.7}, 0, 6)._asdict()
    assert lines_of(level, FOUND["standings"][2] | {"tried": [one]}) == ["4 of 10"]
    assert "doubtful" not in markdown(document_of(FOUND))
    doubted = FOUND | {"standings": [one | {"tried": [try_ | {"unsound": 1} for try_ in one["tried"]]}
                                     for one in FOUND["standings"]]}  # fmt: skip
    assert "simulation.iterations=100" in markdown(document_of(doubted))


def test_runs_whose_numbers_are_doubtful_are_counted_and_kept(here):
    """One iteration of a solver leaves forces that energy does not account for."""
    sets = ["law=stand", "model=h1", "simulation.iterations=1", "simulation.ls_iterations=1", "simulation.solver=CG",
            "duration=0.5", "window.start=0.1", "randomise.runs=2"]  # fmt: skip
    for _ in range(2):  # made, and read again
        table = standard(["stand"], ["space_level"], sets, 1, Path("kept"))
        assert table.standings[0].tried[0].unsound == 2
        assert table.standings[0].tried[0].falls == 2


def test_the_page(here):
    Path("found").mkdir()
    Path("found/standard.json").write_text(json.dumps(FOUND), encoding="utf-8")
    write_page([Path("found")], Path("page.html"), "Tests")
    page = Path("page.html").read_text(encoding="utf-8")
    assert "&lt;b&gt;" in page
    assert "<b>" not in page
    assert "a: 7 of 10 at 6 N s (40 – 89 %)" in page
    Path("found/standard.json").write_text('{"gaits": 3}', encoding="utf-8")
    with pytest.raises(InputError, match="expected what biped standard writes"):
        write_page([Path("found")], Path("other.html"), "Tests")


STANDS = """description = "How large a push walker2d stands"
model = "walker2d"
law = "stand"
duration = 1.9
window.start = 0.8
push = [{ at = 0.5, duration = 0.2, force = [0.0, 0.0] }]
randomise.runs = 2
[standard]
title = "push forward for 0.2 s"
goal = "stood"
key = "push.0.force.0"
of = "weight"
first = 0.02
step = 0.5
last = 1.02
resolution = 0.25
times = 0.2
unit = "N s"
"""


def test_a_robot_of_any_kind_in_units_of_its_own(here):
    Path("stands.toml").write_text(STANDS, encoding="utf-8")
    (standing,) = standard(["normal"], ["stands.toml"], [], 1, Path("out")).standings
    robot = simulate(plan_of("stands.toml", []).run(0)).robot
    assert standing.scale == pytest.approx(robot.mass * GRAVITY)
    assert standing.tried[0].reached == 2, "the easiest push is stood"
    assert standing.limit is not None
    assert standing.limit.fails_at is not None, "a push of the robot's weight is not"


def test_a_robot_in_the_plane_is_not_pushed_or_tilted_to_the_side(here):
    changes = ["model=walker2d", "duration=6.0", "randomise.runs=1", "start.walking=0.0"]
    asked = [f"any/cells/{name}" for name in ("level", "slope_up", "pushes", "slopes", "push_left")]
    found = standard(["any/long"], asked, changes, 1, Path("out")).standings
    assert {one.test.rpartition("/")[2]: len(one.tried) for one in found} == {
        "level": 1, "slope_up": 1, "pushes": 0, "slopes": 0, "push_left": 0
    }  # fmt: skip


LAW = """class Still:
    def __init__(self, setup):
        self.number = len(setup.robot.drives)

    def torques(self, sensed):
        return [0.0] * self.number
"""


@pytest.mark.parametrize(("word", "name"), [("stand", "stand"), ("mine.py:Still", "Still")])
def test_laws_for_any_robot_are_put_to_the_tests(here, word, name):
    Path("mine.py").write_text(LAW, encoding="utf-8")
    changes = ["model=walker2d", "duration=0.4", "window.start=0.1", "window.end=0.4", "randomise.runs=2"]
    (standing,) = standard([word], ["level"], changes, 1, Path("out")).standings
    assert standing.gait == name
    assert [(one.reached, one.runs) for one in standing.tried] == [(0, 2)], "neither walks"


def test_the_law_of_the_thesis_is_put_to_them_by_a_gait():
    with pytest.raises(InputError, match="thesis: expected a gait, by which this law walks"):
        entrant_of("thesis")


CARD = """network = "net.onnx"
rate = 50.0
joints = ["knee"]
default = [0.0]
observation = [{ term = "joint_position" }]
[action]
scale = 0.5
[scenario]
model = "robot.xml"
"""


def test_a_card_brings_its_robot(tmp_path, monkeypatch):
    """A policy's card that is named on the command line runs, on the model beside it."""
    monkeypatch.chdir(tmp_path)
    Path("card.toml").write_text(CARD, encoding="utf-8")
    Path("net.onnx").write_bytes(b"")
    Path("robot.xml").write_text("", encoding="utf-8")
    entrant = entrant_of("card.toml")
    assert (entrant.name, entrant.law, entrant.model) == ("card", True, str(tmp_path / "robot.xml"))
    asked = entrant.all_changes("standard/level", ["model=h1"])
    own, others = asked.index(f'model="{tmp_path / "robot.xml"}"'), asked.index("model=h1")
    assert own < others, "what the command line says stands"


def test_what_needs_a_gait_is_not_asked_of_a_law():
    """A posture, another gait that takes over or a mistake would be dropped, and the row would say what was not run."""
    needs = {f"any/cells/{name}" for name in ("rest", "stop", "damping", "postures", "errors")}
    stander = entrant_of("stand")
    for trial in trials_of(["any/cells/"]):
        asked = study._required_of(trial, stander, ["model=h1"])
        assert (asked is None) == (trial.scenario in needs)
        assert study._required_of(trial, entrant_of("any/g1"), ["model=h1"]) is not None


def test_a_law_begins_a_slope_as_upright_as_a_gait():
    (slopes,) = trials_of(["any/cells/slopes"])
    scenario = study._plan(slopes, entrant_of("stand"), ["model=h1"], 0.0).run(0).scenario
    assert scenario.start.upright
    assert scenario.ground.slope == 3.0


def test_runs_that_were_lost_are_no_falls_and_are_not_kept(here, monkeypatch):
    made = study.run_plan

    def lost(*given):
        found = made(*given)
        found.result["runs"][1] |= {"end": "lost", "cause": "lost: its process was killed, and so was the next"}
        return found

    monkeypatch.setattr(study, "run_plan", lost)
    sets = ["law=stand", "model=h1", "duration=0.2", "window.start=0.1", "randomise.runs=2"]
    for _ in range(2):
        with pytest.raises(RunError, match="1 of 2 runs ended with their process, and count for nothing: lost: its"):
            standard(["stand"], ["space_level"], sets, 1, Path("kept"))
