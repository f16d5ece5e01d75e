"""Which tests are asked of whom, and in which robot's units."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.robot.ground import GRAVITY
from biped.robot.planar.model import tree_at
from biped.scenario.metrics import METRICS
from biped.studies import standard as study
from biped.studies.entrants import entrant_of
from biped.studies.standard import trials_of

TEST = """extends = "upright/anywhere"
description = "A slope of the user"
ground.slope = 2.0
[standard]
title = "2 up"
order = %d
"""


def test_the_family_is_complete_and_in_order():
    tests = trials_of([])
    assert [test.standard.order for test in tests] == sorted(test.standard.order for test in tests)
    names = {test.name.removeprefix("standard/") for test in tests}
    assert {"level", "speed", "slope_up", "slope_down", "push_forward", "push_backward", "tiles", "steps_up",
            "steps_down", "sustained_constant", "sustained_ramp", "sustained_sine", "stop"} <= names  # fmt: skip
    for test in tests:
        assert test.rate == (0.95 if test.name.startswith("standard/unmodelled") else 0.7)
        assert test.standard.title
        assert set(test.standard.shows) <= set(METRICS)
        if test.standard.key is not None:
            s = test.standard
            assert s.first != 0.0
            assert (s.last - s.first) * s.step > 0.0


@pytest.mark.parametrize(("gait", "model"), [("robust", "human"), ("robot", "robot")])
def test_values_are_in_the_robots_own_units(gait, model):
    (push,), (tiles,) = trials_of(["push_forward"]), trials_of(["tiles"])
    sets = [f"model={model}"]
    path = study._plan(push, entrant_of(gait), sets, 0.5).model
    tree = tree_at(path)
    plan = study._plan(push, entrant_of(gait), sets, 0.5)
    assert plan.run(0).scenario.push[0].force[0] == pytest.approx(0.5 * tree.mass.sum() * GRAVITY)
    ground = study._plan(tiles, entrant_of(gait), sets, 0.01).run(0).scenario.ground.tiles
    assert ground.height == pytest.approx(0.01 * tree.leg)
    assert ground.length == pytest.approx(0.6 * tree.leg)
    assert ground.start == pytest.approx(1.2 * tree.leg)


def test_values_are_in_the_units_of_a_robot_in_space():
    (push,) = trials_of(["space_push_sideways"])
    force = study._plan(push, entrant_of("human3d"), [], 0.5).run(0).scenario.push[0].force
    assert force == pytest.approx((0.0, 0.5 * 75.0 * GRAVITY, 0.0))
    (slope,) = trials_of(["space_slope_sideways"])
    assert study._plan(slope, entrant_of("human3d"), [], 2.5).run(0).scenario.ground.side_slope == 2.5


def test_gaits_in_space_have_tests_of_their_own():
    (level,), (space,) = trials_of(["level"]), trials_of(["space_level"])
    assert study._required_of(level, entrant_of("human3d"), []) is None
    assert study._required_of(space, entrant_of("human3d"), []) is space.standard
    assert study._required_of(space, entrant_of("calm"), []) is None


def test_who_is_asked_what():
    (speed,), (stop,), (level,) = (trials_of([name]) for name in ("speed", "stop", "level"))
    family = study._required_of(speed, entrant_of("robust"), [])
    assert family is not None
    assert (family.first, family.last) == (0.5, 1.175)
    assert study._required_of(speed, entrant_of("normal"), []) is None
    assert study._required_of(stop, entrant_of("robust"), []) is stop.standard
    assert study._required_of(stop, entrant_of("calm"), []) is None
    assert study._required_of(level, entrant_of("calm"), []) is level.standard


def test_laws_move_robots_in_the_plane_or_in_space():
    stander = entrant_of("stand")
    assert not stander.in_space(["model=walker2d"])
    assert stander.in_space(["model=h1"])
    push, sideways = trials_of(["push_forward", "space_push_sideways"])
    assert study._required_of(push, stander, ["model=h1"]) is None
    plan = study._plan(sideways, stander, ["model=h1", "start.posture=stand"], 0.5)
    scenario = plan.run(0).scenario
    assert (scenario.law, scenario.start.posture) == ("stand", "stand")
    assert scenario.push[0].force[1] == pytest.approx(0.5 * plan.robot.mass * GRAVITY)
    assert "push.0.at" in plan.run(0).values


def test_a_folder_stands_for_all_tests_below_it(tmp_path, monkeypatch):
    assert {test.name for test in trials_of(["robot/cells/"])} >= {"robot/cells/level", "robot/cells/sensors"}
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own/deep").mkdir(parents=True)
    Path("own/first.toml").write_text(TEST % 2, encoding="utf-8")
    Path("own/deep/second.toml").write_text(TEST % 1, encoding="utf-8")
    assert [test.name for test in trials_of(["own/"])] == ["second", "first"]


def test_a_folder_without_tests_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"upright/cel/: no scenario is below it.*did you mean 'upright/cells/'"):
        trials_of(["upright/cel/"])
    assert main(["standard", "whole", "--test", "empty/", "--out", "found"]) == 2
    assert "--test empty/: no scenario is below it" in capsys.readouterr().err
    assert not Path("found").exists()
