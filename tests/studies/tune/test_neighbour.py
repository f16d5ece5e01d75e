"""Neighbours of a walk in a search's objective: who parts, who does not, and what it costs."""

from __future__ import annotations

import math

import pytest

from biped.base.errors import InputError
from biped.ensemble.campaign import simulate_planar
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.reading import read_scenario
from biped.studies.stability.orbit import parting
from biped.studies.tune.evaluate import Study
from biped.studies.tune.search_space import Candidate
from tests.studies.tune.small import TEXT

WALK = """
controller = "upright"
seed = 3
duration = 5.0
start = { posture = "heel_toe", jitter = 0.002 }

[tune]

[tune.conditions.level]
speed = 0.7
"""


def walk(name: str, *changes: str) -> tuple[Run, Trajectory]:
    run = Plan(read_scenario(name, ["duration=5.0", "window.start=2.0", "window.end=5.0", *changes])).run(0)
    return run, simulate_planar(run)


def test_neighbours_part_where_biped_stability_says_so():
    """Q_d itself walks in a stable cycle; with the release test neighbours part by e^6.7 a return."""
    assert parting(*walk("level_normal", "actuation.mode=generalized")) < 0.0
    assert parting(*walk("robust/own")) > 2.0
    assert parting(*walk("upright/own")) == parting(*walk("upright/own"))


def test_who_does_not_return_parts_beyond_all_bounds():
    assert parting(*walk("calm/stand", "randomise.runs=1")) == math.inf


@pytest.mark.parametrize(("growth", "costs"), [(1000.0, 0.0), (-0.02, 0.02), (-1e6, 0.5)])
def test_what_is_beyond_the_bound_is_an_excess_and_never_worse_than_a_fall(tmp_path, growth, costs, monkeypatch):
    monkeypatch.setattr("biped.studies.tune.evaluate.parting", lambda run, walk: 0.0)
    path = tmp_path / "walk.toml"
    path.write_text(WALK, encoding="utf-8")
    plain = Study(read_scenario(str(path)))
    asked = Study(read_scenario(str(path), [f"tune.conditions.level.growth={growth}"]))
    task = plain.tasks(Candidate(plain.gains, ()), 1, True, {"level": range(1)})[0]
    before, after = plain.outcome(task), asked.outcome(task)
    assert before.walked
    assert after.cost == pytest.approx(min(before.cost + costs, 0.5))
    assert after.cost < 0.5


@pytest.mark.parametrize("changes", [["model=human3d", "controller=human3d"], ["tune.conditions.level.goal=stood"]])
def test_only_planar_walkers_have_such_neighbours(tmp_path, changes):
    path = tmp_path / "small.toml"
    path.write_text(TEXT, encoding="utf-8")
    with pytest.raises(InputError, match=r"tune.conditions.level.growth: expected none"):
        Study(read_scenario(str(path), ["tune.conditions.level.growth=1.0", *changes]))
