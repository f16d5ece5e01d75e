"""Several places where a search may begin: each is tried, the best one goes on, and a killed search finds it again."""

from __future__ import annotations

import json
import tomllib

import pytest

from biped.cli.main import main
from biped.studies.tune.evaluate import GainOutcome, Study

TEXT = """
controller = "fast"
seed = 5
duration = 0.4

[tune]
gains = ["k_d1", "b_d1"]
duration = 0.3
generations = 3
population = 4
checks = 1
unseen = 1
finalists = 1
tries = 2
begin = [{ controller = "fast" }, { controller = "normal", posture = "single" }, { controller = "mine.toml" }]

[tune.conditions.level]
runs = 1
"""
TOLD = {"fast": (800.0, 87.5), "normal": (700.0, 87.5), "mine": (800.0, 71.5)}
MINE = 'extends = "fast"\ntheta_b = 71.5\n\n[start]\nposture = "single"\n'


@pytest.fixture
def scenario_file(tmp_path):
    (tmp_path / "mine.toml").write_text(MINE, encoding="utf-8")
    path = tmp_path / "begun.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def tuned(scenario_file, out):
    assert main(["tune", str(scenario_file), "--out", str(out), "--jobs", "1"]) == 0
    lines = (out / "runs.jsonl").read_text(encoding="utf-8").splitlines()
    return (out / "gait.toml").read_text(encoding="utf-8"), lines


def preferring(monkeypatch, name, walked=False):
    """Runs of one gait, which is told by what does not vary, cost less and may count as walks; the others fall."""

    def outcome(self, task):
        gains = task.candidate.gains
        mine = (gains.k_d2[0], gains.theta_b) == TOLD[name]
        return GainOutcome(0.1 if mine else 0.9, mine and walked, 0.7, 0.3)

    monkeypatch.setattr(Study, "outcome", outcome)


def test_the_search_goes_on_from_the_place_where_a_recheck_was_best(scenario_file, tmp_path, capsys, monkeypatch):
    preferring(monkeypatch, "normal")
    gait, lines = tuned(scenario_file, tmp_path / "out")
    assert [json.loads(line)["index"] for line in lines[1:]] == list(range(1, 10)), "three times two, and three"
    assert "from the gait 'normal', 9 generations" in gait
    found = tomllib.loads(gait)
    assert (found["k_d2"][0], found["theta_b"]) == TOLD["normal"]
    assert found["start"] == {"posture": "single"}
    assert "transitions" not in found, "the gait that it began at names none"
    capsys.readouterr()


def test_a_killed_search_goes_on_as_if_nothing_had_happened(scenario_file, tmp_path, capsys, monkeypatch):
    preferring(monkeypatch, "normal")
    gait, lines = tuned(scenario_file, tmp_path / "whole")
    for kept in (2, 4, 7, 8):
        cut = tmp_path / f"cut{kept}"
        cut.mkdir()
        (cut / "scenario.toml").write_bytes((tmp_path / "whole" / "scenario.toml").read_bytes())
        (cut / "runs.jsonl").write_text("\n".join(lines[:kept]) + "\n", encoding="utf-8")
        assert tuned(scenario_file, cut) == (gait, lines)
    capsys.readouterr()


@pytest.mark.parametrize(("enough", "generations"), [(1.0, 2 + 2 + 3), (None, 3 * 2 + 3)])
def test_no_other_place_is_tried_once_one_is_good_enough(scenario_file, tmp_path, capsys, monkeypatch, enough,
                                                         generations):  # fmt: skip
    preferring(monkeypatch, "normal", walked=True)
    stages = "" if enough is None else (
        f'\n[[tune.stages]]\nenough = {enough}\n\n[[tune.stages]]\nenough = {enough}\nset.ground.slope = 1.0\n'
    )  # fmt: skip
    scenario_file.write_text(TEXT + stages, encoding="utf-8")
    _, lines = tuned(scenario_file, tmp_path / "out")
    # With stages the first one, of the same tests as the tries, is passed over, and the second has its generations.
    assert len(lines) - 1 == generations
    capsys.readouterr()


def test_a_gait_beside_the_scenario_begins_with_its_own_posture(scenario_file, tmp_path, capsys, monkeypatch):
    preferring(monkeypatch, "mine")
    gait, _ = tuned(scenario_file, tmp_path / "out")
    assert f"from the gait '{tmp_path / 'mine.toml'}'" in gait
    assert tomllib.loads(gait)["start"] == {"posture": "single"}
    capsys.readouterr()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('tune.begin=[{controller="fats"}]', ["tune.begin.0.controller", "fats", "fast"]),
        ('tune.begin=[{posture="single"}]', ["tune.begin[0]", "controller"]),
        ('tune.begin=[{controller="fast",posture="heel_tow"}]', ["start.posture", "heel_tow", "heel_toe"]),
        ('tune.begin=[{controler="fast"}]', ["controler", "controller"]),
        ('tune.begin=[{controller="human3d"}]', ["human3d", "plane"]),
    ],
)
def test_mistakes_are_named_before_anything_is_written(scenario_file, tmp_path, capsys, change, words):
    out = tmp_path / "out"
    assert main(["tune", str(scenario_file), "--out", str(out), "--jobs", "1", "--set", change]) == 2
    said = capsys.readouterr().err
    for word in words:
        assert word in said, said
    assert "Traceback" not in said
    assert not out.exists()


def test_a_gait_begins_in_the_posture_that_suits_it_best(scenario_file, tmp_path, capsys, monkeypatch):
    def outcome(self, task):
        mine = self.scenario.start.posture == "heel_toe"
        return GainOutcome(0.1 if mine else 0.9, mine, 0.7, 0.3)

    monkeypatch.setattr(Study, "outcome", outcome)
    scenario_file.write_text(TEXT.replace("begin", 'postures = ["flat", "single", "heel_toe"]\nbegin'), "utf-8")
    gait, _ = tuned(scenario_file, tmp_path / "out")
    assert tomllib.loads(gait)["start"] == {"posture": "heel_toe"}
    assert "Its walk begins in 'heel_toe', the best for it of flat, single, heel_toe." in gait
    found = json.loads((tmp_path / "out" / "result.json").read_bytes())
    assert (found["objective"], found["before"]) == (pytest.approx(0.1), pytest.approx(0.9))
    capsys.readouterr()


def test_a_posture_that_suits_no_better_is_not_taken(scenario_file, tmp_path, capsys, monkeypatch):
    preferring(monkeypatch, "normal")
    scenario_file.write_text(TEXT.replace("begin", 'postures = ["flat", "heel_toe"]\nbegin'), "utf-8")
    gait, _ = tuned(scenario_file, tmp_path / "out")
    assert tomllib.loads(gait)["start"] == {"posture": "single"}
    assert "Its walk begins" not in gait
    capsys.readouterr()


def test_a_posture_that_the_model_lacks_is_refused_before_anything_is_made(scenario_file, tmp_path, capsys):
    scenario_file.write_text(TEXT.replace("begin", 'postures = ["flat", "singel"]\nbegin'), "utf-8")
    assert main(["tune", str(scenario_file), "--out", str(tmp_path / "out")]) == 2
    assert "tune.postures.1" in (error := capsys.readouterr().err)
    assert "'single'" in error
    assert not (tmp_path / "out").exists()


def test_a_gait_that_takes_over_later_begins_in_no_posture(capsys):
    assert main(["tune", "tune/any_stop", "--set", 'tune.postures=["flat"]']) == 2
    assert "tune.postures: expected none with tune.change" in capsys.readouterr().err
