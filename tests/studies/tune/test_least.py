"""The way back from a found gait: one gain a step, the least missed first, the same however often it is interrupted."""

from __future__ import annotations

import json
import math

import pytest
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import locate
from biped.cli.main import main
from biped.scenario.gains import Gains
from biped.scenario.gait import read_gains
from biped.scenario.reading import read_scenario
from biped.studies.tune import least as way
from biped.studies.tune.evaluate import GainOutcome, Study

TEXT = """
controller = "fast"
seed = 5
duration = 0.3

[tune]
generations = 2
checks = 1

[tune.conditions.level]
runs = 1
"""
GAIT = """
extends = "fast"
k_d1 = 700.0
theta_b = 80.0
k_d2 = [800.0, 61.0, 70.0, 0.0]
"""


@pytest.fixture
def files(tmp_path):
    (tmp_path / "small.toml").write_text(TEXT, encoding="utf-8")
    (tmp_path / "found.toml").write_text(GAIT, encoding="utf-8")
    return tmp_path / "small.toml", tmp_path / "found.toml"


def test_gaits_differ_in_single_numbers_and_mix(files):
    origin = Study(read_scenario(str(files[0]))).gains
    found = read_gains(files[1], Gains())
    names = way.different(origin, found)
    assert names == ["k_d1", "k_d2.1", "theta_b"]
    assert way.mixed(found, origin, names) == origin
    assert way.mixed(found, origin, []) == found
    half = way.mixed(found, origin, ["k_d2.1"])
    assert half.k_d2 == origin.k_d2
    assert half.theta_b == 80.0


def test_gaits_in_space_differ_out_of_the_plane_too():
    origin, found = (read_gains(locate("controllers", name, ""), Gains()) for name in ("human3d_start", "human3d"))
    names = way.different(origin, found)
    assert {"frontal.k_d2.0", "frontal.placement.velocity", "axial.b_d1", "k_d3.0"} <= set(names)
    assert "axial.theta_b" not in names  # 0 in both
    assert way.mixed(found, origin, names) == origin
    half = way.mixed(found, origin, ["frontal.placement.velocity"])
    assert half.frontal is not None
    assert found.frontal is not None
    assert half.frontal.placement == replace(found.frontal.placement, velocity=0.31)
    with pytest.raises(InputError, match=r"gains.frontal: the found gait has none .* expected both or neither"):
        way.different(origin, read_gains(locate("controllers", "calm", ""), Gains()))


def test_what_is_missed_least_goes_first(files, monkeypatch):
    study = Study(read_scenario(str(files[0])))
    origin, found = study.gains, read_gains(files[1], Gains())

    def evaluate(tasks):
        # k_d1 means everything, theta_b something, the thigh nothing.
        out = []
        for task in tasks:
            gains = task.candidate.gains
            cost = abs(math.log(gains.k_d1 / 700.0)) + 0.01 * abs(gains.theta_b - 80.0)
            out.append(GainOutcome(cost, cost < 0.05, 0.8, 0.2))
        return out

    steps = []
    for _ in range(4):
        steps.append(way._step(study, evaluate, "g", origin, found, ["k_d1", "k_d2.1", "theta_b"], steps))
    assert [step["restored"] for step in steps] == ["", "k_d2.1", "theta_b", "k_d1"]
    assert [step["changed"] for step in steps] == [3, 2, 1, 0]
    assert [step["tallies"]["level"] for step in steps] == [[1, 1], [1, 1], [0, 1], [0, 1]]
    assert (steps[2]["before"], steps[2]["after"]) == (80.0, origin.theta_b)


def test_the_command_its_files_and_an_interruption(files, tmp_path, capsys):
    def back(out, *more):
        return main(["tune", str(files[0]), "--least", str(files[1]), "--out", str(out), "--jobs", "1", *more])

    assert back(tmp_path / "whole") == 0
    assert "changed" in capsys.readouterr().out
    whole = json.loads((tmp_path / "whole" / "result.json").read_text(encoding="utf-8"))
    assert [step["changed"] for step in whole["steps"]] == [3, 2, 1, 0]
    assert (tmp_path / "whole" / "least.png").stat().st_size > 1000
    cut = tmp_path / "cut"
    cut.mkdir()
    (cut / "scenario.toml").write_bytes((tmp_path / "whole" / "scenario.toml").read_bytes())
    lines = (tmp_path / "whole" / "runs.jsonl").read_text(encoding="utf-8").splitlines()
    (cut / "runs.jsonl").write_text("\n".join(lines[:3]) + "\n", encoding="utf-8")
    assert back(cut, "--json") == 0
    assert json.loads(capsys.readouterr().out)["steps"] == whole["steps"]


def test_mistakes_are_named(files, tmp_path, capsys):
    assert main(["tune", str(files[0]), "--least", "fast", "--out", str(tmp_path / "a"), "--jobs", "1"]) == 2
    assert "another gait" in capsys.readouterr().err
    assert main(["tune", str(files[0]), "--least", "fst", "--out", str(tmp_path / "a"), "--jobs", "1"]) == 2
    assert "did you mean 'fast'" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()
    assert main(["tune", str(files[0]), "--out", str(tmp_path / "search"), "--jobs", "1"]) == 0
    before = (tmp_path / "search" / "runs.jsonl").read_bytes()
    capsys.readouterr()
    again = ["tune", str(files[0]), "--least", str(files[1]), "--out", str(tmp_path / "search"), "--jobs", "1"]
    assert main(again) == 2
    assert "holds another search" in capsys.readouterr().err
    assert (tmp_path / "search" / "runs.jsonl").read_bytes() == before
