"""`--set` of entries of a gait's own lists: gains.theta_l.2."""

from __future__ import annotations

import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.scenario.gains import Gains
from biped.scenario.gait import read_gains
from biped.scenario.reading import read_scenario

STURDY = "controller=sturdy"


def own(gait: str) -> Gains:
    return read_gains(locate("controllers", gait, ""), Gains())


def test_an_entry_of_a_gaits_list_leaves_the_others_as_they_are():
    gains = read_scenario("upright/level", [STURDY, "gains.theta_l.2=121.6"]).gains
    mine = own("sturdy").theta_l
    assert gains.theta_l == (mine[0], mine[1], 121.6, mine[3])
    assert gains.k_d2 is None, "what is not changed is the gait's"


def test_the_gait_may_be_named_after_the_entry():
    after = read_scenario("upright/level", ["gains.theta_l.2=121.6", STURDY])
    assert after.gains == read_scenario("upright/level", [STURDY, "gains.theta_l.2=121.6"]).gains


def test_several_entries_and_a_list_that_the_scenario_has():
    gains = read_scenario("upright/level", [STURDY, "gains.k_d3=[1.0,2.0,3.0,4.0]", "gains.k_d3.1=5.0",
                                            "gains.k_d2.0=500.0", "gains.k_d2.2=180.0"]).gains  # fmt: skip
    assert gains.k_d3 == (1.0, 5.0, 3.0, 4.0)
    mine = own("sturdy").k_d2
    assert gains.k_d2 == (500.0, mine[1], 180.0, mine[3])


def test_a_list_of_a_table():
    frontal = read_scenario("spatial/own", ["controller=human3d_sturdy", "gains.frontal.k_d2.1=430.0"]).gains.frontal
    mine = own("human3d_sturdy").frontal.k_d2
    assert frontal.k_d2 == (mine[0], 430.0, *mine[2:])


def test_a_family_has_the_lists_of_the_scenarios_speed():
    at = read_scenario("upright/level", ["controller=pace", "gains.speed=0.55", "gains.k_d2.0=1.0"]).gains.k_d2
    mine = read_gains(locate("controllers", "pace", ""), Gains(speed=0.55)).k_d2
    assert at == (1.0, *mine[1:])
    together = read_scenario("upright/level", ["controller=pace", "gains={speed=0.55,k_d2={0=1.0}}"]).gains.k_d2
    assert together == at


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ([STURDY, "gains.theta_l.4=1.0"], r"gains.theta_l.4: expected an entry of gains.theta_l, which has 4"),
        ([STURDY, "gains.frontal.k_d2.1=1.0"], r"gains.frontal: controllers.sturdy.toml has none"),
        ([STURDY, "gains.theta_x.1=1.0"], r"gains.theta_x: unknown key; did you mean 'theta_l'"),
        ([STURDY, "gains.k_d1.0=1.0"], r"gains.k_d1: expected a number, got a table"),
        (["sweep.controller=['sturdy','whole']", "gains.theta_l.2=1.0"], r"several gaits, each with its own"),
        (
            ["sweep={'gains.speed'=[0.5,0.7]}", "controller=pace", "gains.k_d2.0=1.0"],
            r"several gaits, each with its own",
        ),
        (["randomise={draw={controller={grid=['sturdy','whole']}}}", "gains.theta_l.2=1.0"], r"several gaits"),
        (["randomise=3", "gains.theta_l.2=1.0"], r"randomise: expected a table"),
        (["controller=study", "gains.theta_l.2=1.0"], r"no gait 'study'|did you mean 'sturdy'"),
    ],
)
def test_what_is_not_there_is_refused(changes, complaint):
    with pytest.raises(InputError, match=complaint):
        read_scenario("upright/level", changes)
