"""The thesis's numbers stand only beside what they were printed for."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.scenario.reading import read_scenario
from biped.studies.run import plan_of

PRINTED = {"speed": 0.81, "cost_of_transport": 0.19, "double_support": 0.156}


@pytest.mark.parametrize("change", ["seed=3", "start.posture=single", "ground.slope=0.0", "controller=normal",
                                    "ground.friction=1.0", "actuation.mode=generalized", "engine=home"])  # fmt: skip
def test_they_stay_where_the_gait_and_the_place_do(change):
    assert read_scenario("level_normal", [change]).thesis == PRINTED


@pytest.mark.parametrize(
    "change",
    ["controller=robust", "gains.k_d1=200.0", "ground.slope=3.0", "push=[{at=1.0,duration=0.1,force=[9.0,0.0]}]",
     "sweep={controller=['slow','fast']}", "sweep={'gains.k_d1'=[100.0,200.0]}", "truth.joint_damping=1.0",
     "randomise.draw={'ground.slope'={uniform=[0.0,3.0]}}"],
)  # fmt: skip
def test_they_go_where_something_else_walks(change):
    assert read_scenario("level_normal", [change]).thesis == {}


def test_a_scenario_that_gives_its_own_keeps_them(tmp_path):
    own = tmp_path / "own.toml"
    own.write_text('extends = "level_normal"\ncontroller = "robust"\n[thesis]\nspeed = 0.5\n', encoding="utf-8")
    assert read_scenario(str(own)).thesis == {"speed": 0.5}, "its own number, none of the gait that it replaced"
    assert read_scenario("level_fast").thesis["speed"] == 0.92
    assert read_scenario("level_normal", ["controller=robust", "thesis.speed=0.6"]).thesis == {"speed": 0.6}


def test_the_effective_scenario_says_the_same(tmp_path):
    from biped.scenario.reading import to_toml

    for changes, expected in (([], PRINTED), (["controller=robust"], {})):
        file = Path(tmp_path / "effective.toml")
        file.write_text(to_toml(plan_of("level_normal", changes).scenario), encoding="utf-8")
        assert read_scenario(str(file)).thesis == expected
