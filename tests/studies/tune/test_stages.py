"""A search in stages: each starts where the one before ended, holds what it is told to, and is resumed exactly."""

from __future__ import annotations

import json

import numpy as np
import pytest
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.cli.main import main
from biped.scenario.gains import Gains, Pace
from biped.scenario.gait import read_gains
from biped.scenario.goals import Tune
from biped.scenario.reading import read_scenario
from biped.studies.tune import gait_text
from biped.studies.tune.evaluate import GainOutcome, Study, Task
from biped.studies.tune.search import Search, ended
from biped.studies.tune.search_space import Candidate, SearchSpace
from biped.studies.tune.stages import studies, study_from

TEXT = """
controller = "fast"
seed = 5
duration = 0.4

[tune]
gains = ["k_d1", "k_d2", "theta_b"]
duration = 0.3
generations = 2
population = 4
checks = 1
unseen = 1
finalists = 1

[tune.conditions.level]
runs = 1

[tune.conditions.uphill]
runs = 1
set.ground.slope = 5.0

[[tune.stages]]
conditions = ["level"]
hold = { theta_b = 80.0, "k_d2.1" = 61.0 }
set.actuation.release_force = 100.0
generations = 1

[[tune.stages]]
spread = 0.2
checks = 2
"""


@pytest.fixture
def scenario_file(tmp_path):
    path = tmp_path / "staged.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_each_stage_is_a_search_of_its_own(scenario_file):
    scenario = read_scenario(str(scenario_file))
    first, second = studies(scenario)
    assert list(first.tune.conditions) == ["level"]
    assert first.tune.generations == 1
    assert first.gains.theta_b == 80.0
    assert first.gains.k_d2 == (800.0, 61.0, *first.gains.k_d2[2:])
    assert {axis.name for axis in SearchSpace(first.scenario, first.gains).axes} == {"k_d1", "k_d2.0", "k_d2.2"}
    assert first.condition("level", True).actuation.release_force == 100.0
    assert list(second.tune.conditions) == ["level", "uphill"]
    assert second.tune.spread == 0.2
    assert [stage.tune.checks for stage in (first, second)] == [1, 2]
    assert second.condition("level", True).actuation.release_force == 150.0
    assert "theta_b" in {axis.name for axis in SearchSpace(second.scenario, second.gains).axes}


def test_a_stage_ends_with_a_recheck_that_is_good_enough():
    tune = Tune(generations=4, enough=0.75)
    good, poor = ({"tallies": {"level": [walked, 8, 0.7, 0.3], "uphill": [8, 8, 0.7, 0.3]}} for walked in (6, 5))
    assert not ended([], tune)
    assert not ended([{}, poor], tune)
    assert not ended([good, {}], tune), "the generation after it has no say in whether it ends"
    assert ended([{}, good], tune)
    assert not ended([{}, good], Tune(generations=4))
    assert ended([{}, {}, {}, poor], tune)


def test_what_a_killed_search_had_found_good_enough_is_not_searched_on(scenario_file, tmp_path, capsys, monkeypatch):
    """All runs count as walks: the first stage ends with its first re-check, and so it does when it is replayed."""
    monkeypatch.setattr(Study, "outcome", lambda self, task: GainOutcome(0.1, True, 0.7, 0.3))
    text = TEXT.replace("generations = 1\n", "generations = 3\nenough = 1.0\nspread = 0.1\n")
    scenario_file.write_text(text.replace("checks = 1", "checks = 1\nrecheck = 2"), encoding="utf-8")
    out = tmp_path / "out"
    assert main(["tune", str(scenario_file), "--jobs", "1", "--out", str(out)]) == 0
    lines = (out / "runs.jsonl").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + 2 + 2, "a head, two generations instead of three, and two of the second stage"
    gait = (out / "gait.toml").read_bytes()
    for rest in (2, 3, 4):
        (out / "runs.jsonl").write_text("\n".join(lines[:rest]) + "\n", encoding="utf-8")
        assert main(["tune", str(scenario_file), "--jobs", "1", "--out", str(out)]) == 0
        assert (out / "gait.toml").read_bytes() == gait
    capsys.readouterr()


def test_a_stage_that_asks_for_nothing_more_is_passed_over(scenario_file, tmp_path, capsys, monkeypatch):
    """All runs count as walks: a second stage of the same tests has nothing to do, one with other tests has."""
    monkeypatch.setattr(Study, "outcome", lambda self, task: GainOutcome(0.1, True, 0.7, 0.3))
    stages = """
[[tune.stages]]
enough = 0.9
generations = 3

[[tune.stages]]
enough = 1.0
spread = 0.2
generations = 3

[[tune.stages]]
enough = 0.5
generations = 3
set.ground.slope = 1.0
"""
    text = TEXT[: TEXT.index("[[tune.stages]]")].replace("checks = 1", "checks = 1\nrecheck = 2") + stages
    for count, generations in ((3, 4), (2, 2)):
        cut = text if count == 3 else text[: text.rindex("[[tune.stages]]")]
        scenario_file.write_text(cut, encoding="utf-8")
        out = tmp_path / f"out{count}"
        assert main(["tune", str(scenario_file), "--jobs", "1", "--out", str(out)]) == 0
        lines = (out / "runs.jsonl").read_text(encoding="utf-8").splitlines()
        assert len(lines) == 1 + generations
        gait = (out / "gait.toml").read_bytes()
        (out / "runs.jsonl").write_text("\n".join(lines[:2]) + "\n", encoding="utf-8")
        assert main(["tune", str(scenario_file), "--jobs", "1", "--out", str(out)]) == 0
        assert (out / "gait.toml").read_bytes() == gait
    capsys.readouterr()


def test_a_stage_may_end_with_the_gait_that_it_began_with(scenario_file):
    """Every step away from the start costs more: the last comparison has the start too."""
    study = Study(read_scenario(str(scenario_file), ["tune.stages=[]"]))

    def evaluate(tasks):
        away = [task.candidate != origin for task in tasks]
        return [GainOutcome(1.0 if one else 0.2, True, 0.7, 0.3) for one in away]

    space = SearchSpace(study.scenario, study.gains)
    origin = space.candidate([0.0] * len(space.axes))
    for continues in (False, True):
        search = Search(study, evaluate, before=7, continues=continues)
        search.generation()
        search.generation()
        x, generation = search.best()
        assert generation == 7
        assert space.candidate(x) == origin
    first = Search(study, evaluate)
    first.generation()
    first.generation()
    found = first.finish()
    assert found.candidate == origin
    assert found.cost == found.start_cost
    text = gait_text("s", first, found)
    assert "from the gait 'fast', 2 generations of 4 (16 runs); none was better than it." in text


def test_a_gait_that_is_no_better_than_what_was_found_is_not_the_answer(scenario_file):
    """All cost the same: a search for more than it can see still moves."""
    study = Study(read_scenario(str(scenario_file), ["tune.stages=[]"]))
    search = Search(study, lambda tasks: [GainOutcome(0.2, True, 0.7, 0.3) for _ in tasks])
    search.generation()
    search.generation()
    assert search.best()[1] == 2


def test_the_gait_of_a_change_varies_and_the_first_one_stays(scenario_file, tmp_path, capsys):
    text = TEXT.replace('controller = "fast"', 'controller = "fast"\nchange = [{at = 0.1, controller = "normal"}]')
    scenario_file.write_text(text.replace("[tune]\n", "[tune]\nchange = 0\n"), encoding="utf-8")
    first, _ = studies(read_scenario(str(scenario_file)))
    normal = read_gains_of("normal")
    assert first.gains == replace(normal, theta_b=80.0, k_d2=(normal.k_d2[0], 61.0, *normal.k_d2[2:]))
    assert first.gait == "normal"
    space = SearchSpace(first.scenario, first.gains)
    run = first._run(Task("level", 0, 3, False, space.candidate([0.1] * len(space.axes))))
    assert run.gains == read_gains_of("fast")
    assert run.scenario.change[0].gains.k_d1 == pytest.approx(normal.k_d1 * np.exp(0.1), rel=1e-3)
    assert main(["tune", str(scenario_file), "--jobs", "1", "--out", str(tmp_path / "out")]) == 0
    text = (tmp_path / "out" / "gait.toml").read_text(encoding="utf-8")
    assert "from the gait 'normal'" in text
    assert read_gains(tmp_path / "out" / "gait.toml", Gains()).k_d3 == normal.k_d3
    capsys.readouterr()


PACE = "pace={speed=0.9,slope=0.0,side=0.0,swing=0.0,stance=0.1}"


def test_what_a_stage_adds_varies_from_there_on(scenario_file):
    text = scenario_file.read_text(encoding="utf-8").replace('gains = ["k_d1", "k_d2", "theta_b"]\n', "")
    scenario_file.write_text(text, encoding="utf-8")
    scenario = read_scenario(str(scenario_file), [f"tune.stages=[{{}},{{add={{{PACE}}}}}]"])
    first, second = studies(scenario)
    assert first.gains.pace is None
    assert second.gains.pace == Pace(0.9, 0.0, 0.0, 0.0, 0.1)
    varied = [{axis.name for axis in SearchSpace(study.scenario, study.gains).axes} for study in (first, second)]
    assert varied[1] - varied[0] == {"pace.speed", "pace.slope", "pace.swing", "pace.stance"}
    found = replace(first.gains, k_d1=123.0)
    assert study_from(scenario, 1, Candidate(found, ())).gains == replace(found, pace=second.gains.pace)
    own = replace(found, pace=Pace(0.7, 0.0, 0.0, 0.2, 0.3))  # one that has it keeps its own
    assert study_from(scenario, 1, Candidate(own, ())).gains == own


@pytest.mark.parametrize("change", ["tune.change=0", "tune.change=1"])
def test_a_change_that_names_no_gait_cannot_vary(scenario_file, change):
    with pytest.raises(InputError, match=r"change: expected a change . that names a gait"):
        studies(read_scenario(str(scenario_file), ["change=[{at=0.1,gains.k_d1=1.0}]", change]))


def test_a_stage_starts_at_what_the_one_before_found(scenario_file):
    scenario = read_scenario(str(scenario_file))
    first = studies(scenario)[0]
    space = SearchSpace(first.scenario, first.gains)
    found = space.candidate([0.1] * len(space.axes))
    second = study_from(scenario, 1, found)
    assert second.gains == found.gains
    assert second.gains.theta_b == 80.0  # it stays until the second stage moves it


def test_keys_that_were_found_go_on_too(scenario_file):
    scenario = read_scenario(str(scenario_file), ['tune.keys={"sensing.ahead"={min=0.0,max=0.2}}'])
    second = study_from(scenario, 1, Candidate(studies(scenario)[0].gains, (("sensing.ahead", 0.15),)))
    assert second.scenario.sensing.ahead == 0.15
    space = SearchSpace(second.scenario, second.gains)
    assert space.candidate(np.zeros(len(space.axes))).keys == (("sensing.ahead", 0.15),)


def test_a_key_may_vary_from_a_stage_on(scenario_file):
    text = TEXT.replace("spread = 0.2", 'keys."sensing.ahead" = { min = 0.2, max = 0.4, start = 0.3 }')
    scenario_file.write_text(text, encoding="utf-8")
    scenario = read_scenario(str(scenario_file))
    first, second = studies(scenario)
    assert (first.tune.keys, list(second.tune.keys)) == ({}, ["sensing.ahead"])
    space = SearchSpace(second.scenario, second.gains)
    assert dict(space.candidate(np.zeros(len(space.axes))).keys) == {"sensing.ahead": 0.3}
    went_on = study_from(scenario, 1, Candidate(second.gains, (("sensing.ahead", 0.25),)))
    assert went_on.base.sensing.ahead == 0.25


@pytest.mark.parametrize(
    ("span", "words"),
    [
        ('"sensing.ahed" = { min = 0.0, max = 1.0 }', "did you mean 'ahead'"),
        ('"sensing.ahead" = { min = 0.3, max = 0.2 }', "expected min < max"),
    ],
)
def test_complaints_of_a_key_of_a_stage_name_the_stage(scenario_file, span, words):
    scenario_file.write_text(TEXT.replace("spread = 0.2", f"keys.{span}"), encoding="utf-8")
    with pytest.raises(InputError, match=rf"^tune\.stages\.1\.keys.*{words}"):
        studies(read_scenario(str(scenario_file)))


def test_whole_search_and_one_that_was_killed_in_its_second_stage(scenario_file, tmp_path, capsys):
    def tuned(out):
        assert main(["tune", str(scenario_file), "--out", str(out), "--jobs", "1"]) == 0
        return (out / "gait.toml").read_text(encoding="utf-8"), (out / "runs.jsonl").read_text(encoding="utf-8")

    gait, journal = tuned(tmp_path / "whole")
    lines = journal.splitlines()
    assert [json.loads(line)["index"] for line in lines[1:]] == [1, 2, 3]
    assert "3 generations of 4" in gait
    gains = read_gains(tmp_path / "whole" / "gait.toml", Gains())
    assert gains.k_d3 == read_gains_of("fast").k_d3  # never varied
    for kept in (2, 3):
        cut = tmp_path / f"cut{kept}"
        cut.mkdir()
        (cut / "scenario.toml").write_bytes((tmp_path / "whole" / "scenario.toml").read_bytes())
        (cut / "runs.jsonl").write_text("\n".join(lines[:kept]) + "\n", encoding="utf-8")
        assert tuned(cut) == (gait, journal)


def test_a_search_may_end_early_and_go_on_later(scenario_file, tmp_path, capsys):
    def tuned(*more):
        return main(["tune", str(scenario_file), "--out", str(tmp_path / "out"), "--jobs", "1", *more])

    assert tuned("--generations", "1") == 0
    gait = tmp_path / "out" / "gait.toml"
    assert "1 generations of 4" in (text := gait.read_text(encoding="utf-8"))
    assert tuned("--generations", "1") == 0  # nothing is made again
    assert gait.read_text(encoding="utf-8") == text
    assert tuned() == 2  # what is there is not written over
    assert "move it away" in capsys.readouterr().err
    gait.unlink()
    assert tuned() == 0
    assert "3 generations of 4" in gait.read_text(encoding="utf-8")


def test_a_search_that_ends_before_its_first_check_has_no_gait(tmp_path, capsys):
    path = tmp_path / "plain.toml"
    path.write_text(TEXT.partition("[[tune.stages]]")[0], encoding="utf-8")
    assert main(["tune", str(path), "--out", str(tmp_path / "out"), "--jobs", "1", "--generations", "1"]) == 2
    assert "--generations: expected at least 2" in capsys.readouterr().err
    assert not (tmp_path / "out" / "gait.toml").exists()
    assert main(["tune", str(path), "--generations", "0"]) == 2
    assert main(["tune", str(path), "--generations", "2", "--least", "fast"]) == 2


def read_gains_of(name):
    from biped.base.files import locate

    return read_gains(locate("controllers", name, "controller"), Gains())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('tune.stages=[{conditions=["levle"]}]', ["tune.stages.0.conditions", "levle", "did you mean 'level'"]),
        ("tune.stages=[{conditions=[]}]", ["tune.stages.0.conditions", "at least one"]),
        ("tune.stages=[{},{hold={theta_l=3.0}}]", ["tune.stages.1.hold", "no gain 'theta_l'"]),
        ('tune.stages=[{hold={"k_d2.4"=3.0}}]', ["tune.stages.0.hold", "k_d2.4"]),
        ("tune.stages=[{set={gains={k_d1=3.0}}}]", ["tune.stages.0.set", "gains", "hold"]),
        ("tune.stages=[{set={seed=3}}]", ["tune.stages.0.set", "seed"]),
        ("tune.stages=[{set={ground={slop=3.0}}}]", ["tune.stages.0.set", "slop", "slope"]),
        ("tune.stages=[{generation=3}]", ["tune.stages[0].generation", "generations"]),
        ("tune.stages=[{hold={k_d1=1.0,theta_b=70.0}}]", ["tune.gains"]),
        ("tune.stages=[{},{add={pace={speed=0.9}}}]", ["tune.stages.1.add", "missing", "pace.stance"]),
        ("tune.stages=[{add={k_d1=3.0}}]", ["tune.stages[0].add", "k_d1"]),
    ],
)
def test_mistakes_are_named_before_anything_is_written(scenario_file, tmp_path, capsys, change, words):
    more = ["--set", 'tune.gains=["k_d1","theta_b"]'] if words == ["tune.gains"] else []
    out = tmp_path / "out"
    code = main(["tune", str(scenario_file), "--out", str(out), "--jobs", "1", "--set", change, *more])
    said = capsys.readouterr().err
    assert code == 2
    for word in words:
        assert word in said
    assert not out.exists()


def test_scenario_without_tune_is_refused_as_before():
    with pytest.raises(InputError, match="tune: missing"):
        studies(read_scenario("level_fast"))
