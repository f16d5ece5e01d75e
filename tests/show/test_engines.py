"""The table of engines: counts, intervals and speeds; a dash where an engine cannot simulate a robot."""

from __future__ import annotations

import math

from biped.ensemble import campaign
from biped.show.engines import table
from biped.studies.surveys import Cell, ScenarioCells, cells_of


def test_a_row_has_a_cell_for_each_engine():
    walked = Cell(19, 20, (0.694, 0.012), ["7: fell backward"])
    stood = Cell(20, 20, (0.001, math.nan), [])
    name = "A policy (owner/name, 1a2b3c4)"
    rows = [ScenarioCells("`a`", "walked", {"one": walked, "two": "seven links only", "three": None}),
            ScenarioCells(name, "stood", {"one": stood, "two": stood, "three": None})]  # fmt: skip
    assert table(rows, ("one", "two", "three")).splitlines() == [
        "| scenario | goal | `one` | `two` | `three` |",
        "|---|---|---|---|---|",
        "| `a` | walked | 19 of 20 (76 – 99 %); 0.694 ± 0.012 m/s | – | not run |",
        f"| {name} | stood | 20 of 20 (84 – 100 %) | 20 of 20 (84 – 100 %) | not run |",
    ]


def test_runs_are_shared_among_the_points_of_a_sweep_and_not_repeated(tmp_path, monkeypatch):
    row = cells_of("any/human", ("home", "mujoco"), 1, tmp_path, 2)
    assert row.scenario == "`any/human`"
    assert row.goal == "stood"
    assert cells_of("any/robot", ("home", "mujoco"), 1, tmp_path, 2, finished=True).cells["mujoco"] is None
    assert "seven links" in row.cells["home"]
    assert row.cells["mujoco"].runs == 2
    assert row.cells["mujoco"].reached == 2
    monkeypatch.setattr(campaign, "run_one", None)  # what is finished is not made again
    assert cells_of("any/human", ("mujoco",), 1, tmp_path, 2).cells["mujoco"] == row.cells["mujoco"]
    assert cells_of("any/human", ("mujoco",), 1, tmp_path, finished=True).cells["mujoco"] == row.cells["mujoco"]


def test_a_scenario_that_is_not_shipped_is_named_by_its_description(tmp_path):
    own = tmp_path / "own.toml"
    own.write_text('extends = "any/human"\ndescription = "A human of nobody\'s"\n')
    assert cells_of(str(own), ("home",), 1, tmp_path, 2).scenario == "A human of nobody's"
