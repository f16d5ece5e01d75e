"""`biped tune`: what it finds does not depend on luck, jobs or interruptions, and can be walked with at once."""

from __future__ import annotations

import json
import sys
import tomllib

import numpy as np
import pytest

from biped.base.typed import convert
from biped.cli.main import main
from biped.ensemble.plan import Plan
from biped.scenario.gains import Gains
from biped.scenario.gait import read_gains
from biped.scenario.reading import read_scenario


def tuned(path, out, *more):
    assert main(["tune", str(path), "--out", str(out), "--jobs", "1", *more]) == 0
    return (out / "gait.toml").read_text(encoding="utf-8"), (out / "runs.jsonl").read_text(encoding="utf-8")


def test_without_cma_the_extra_is_named(scenario_file, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "cma", None)
    assert main(["tune", str(scenario_file), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 2
    assert "pip install cma" in capsys.readouterr().err


@pytest.mark.parametrize(("keys", "words"), [
    ('gains = ["theta_b", "nope"]', "tune.gains: no gain 'nope'"),
    ('gains = ["k_d1", "k_d9"]\nstages = [{}, {}]', "tune.gains: no gain 'k_d9'; did you mean 'k_d"),
    ("gains = []", "tune.gains: expected at least one gain or key"),
    ("conditions.x.set.grund.slope = 3.0", "tune.conditions.x.set: grund: unknown key; did you mean 'ground'?"),
    ('keys."ground.slope" = { min = 3.0, max = 1.0 }', 'tune.keys."ground.slope": expected min < max'),
    ("stages = [{ conditions = ['levl'] }]", "tune.stages.0.conditions: no condition 'levl'; did you mean 'level'"),
    ('begin = [{ controller = "calmer" }]', "tune.begin.0.controller: no controller 'calmer'; expected"),
])  # fmt: skip
def test_a_complaint_names_the_file_and_the_key(scenario_file, tmp_path, capsys, keys, words):
    mine = tmp_path / "mine.toml"
    mine.write_text(f'extends = "{scenario_file}"\n[tune]\n{keys}\n', encoding="utf-8")
    assert main(["tune", str(mine), "--out", str(tmp_path / "out")]) == 2
    assert f"mine.toml: {words}" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


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


def test_a_gait_that_was_edited_is_not_written_over(scenario_file, tmp_path, capsys):
    gait, _ = tuned(scenario_file, tmp_path / "out")
    edited = gait.replace("description = ", 'source_of_mine = ""\ndescription = ')
    (tmp_path / "out" / "gait.toml").write_text(edited, encoding="utf-8")
    assert main(["tune", str(scenario_file), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 2
    assert "gait.toml: is not what this search found; move it away" in capsys.readouterr().err
    assert (tmp_path / "out" / "gait.toml").read_text(encoding="utf-8") == edited
    (tmp_path / "out" / "gait.toml").unlink()
    assert tuned(scenario_file, tmp_path / "out")[0] == gait


def test_gait_file_is_the_gait_that_was_scored(scenario_file, tmp_path, capsys):
    gait, _ = tuned(scenario_file, tmp_path / "out")
    assert "seeds never used" in gait
    assert "'fast'" in gait
    read = read_gains(tmp_path / "out" / "gait.toml", Gains())
    data = tomllib.loads(gait)
    assert read == convert({name: data[name] for name in Gains.__struct_fields__ if name in data}, Gains)
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
