"""The step back in space: when a walker falls back, which way it heads, and in which units its numbers are."""

from __future__ import annotations

import math

import numpy as np
import pytest
from msgspec import structs

from biped.base.errors import InputError
from biped.control.space.setup import Unit, si_backstep
from biped.control.space.tick import walker_falls_back
from biped.scenario.gains import MGL
from biped.scenario.keys import Backstep
from biped.scenario.reading import read_scenario
from tests.control.space.scene import Scene

HEEL_OF_THE_LEFT = 3


def fallen(scene: Scene, place: float, speed: float, heading: float = 0.0) -> bool:
    """Whether it falls back whose centre of mass is so far ahead of the only heel that stands; the right leg swings."""
    c, at = scene.c, scene.c["at"]
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    c["gait"]["heading"] = heading
    c["memory"]["believed"][:], c["memory"]["phase"][:] = 0, (2, 0)
    c["memory"]["believed"][HEEL_OF_THE_LEFT] = 1
    heel = at["place"][2 * HEEL_OF_THE_LEFT : 2 * HEEL_OF_THE_LEFT + 2]
    at["com"][:] = heel[np.argmin(heel @ ahead)] + place * ahead
    at["com"][2], at["com_velocity"][:] = 1.0, speed * ahead
    walker_falls_back(c)
    return bool(c["memory"]["back"])


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.0])
def test_it_falls_back_when_its_extrapolated_centre_is_behind_every_contact_along_its_heading(heading):
    scene = Scene("backstep.margin=0.05")
    scene.sensed(scene.q, scene.v)
    reach = math.sqrt(1.0 / 9.81)
    assert fallen(scene, -0.06, 0.0, heading)
    assert scene.c["memory"]["phase"].tolist() == [3, 0], "the leg in the air is extended, the other stands"
    assert not fallen(scene, -0.04, 0.0, heading)
    assert scene.c["memory"]["phase"].tolist() == [2, 0]
    assert not fallen(scene, -0.06, 0.02 / reach, heading)
    assert fallen(scene, 0.2, -0.26 / reach, heading)
    scene.c["memory"]["believed"][:] = 0
    walker_falls_back(scene.c)
    assert not scene.c["memory"]["back"], "in flight nothing is behind anything"


def test_behind_means_vertically_below_on_a_slope():
    scene, below = Scene("backstep.margin=0.0", "ground.slope=5.0"), math.tan(math.radians(5.0))
    scene.sensed(scene.q, scene.v)
    assert fallen(scene, below - 0.001, 0.0)
    assert not fallen(scene, below + 0.001, 0.0)


def test_its_numbers_are_in_the_units_of_the_gait():
    gains = structs.replace(Scene().setup.gains, unit=MGL)
    unit, of = Unit(50.0, 0.8), Backstep(0.1, 70.0, 0.4, 0.02, 1.2, 0.2, 0.01)
    si, time = si_backstep(of, gains, unit), math.sqrt(0.8 / 9.81)
    assert si is not None
    moment = 50.0 * 9.81 * 0.8
    assert (si.margin, si.theta_l, si.bend) == pytest.approx((0.08, 70.0, 1.2))
    assert (si.k_d2, si.b_d2) == pytest.approx((0.4 * moment, 0.02 * moment * time))
    assert (si.k_d3, si.b_d3) == pytest.approx((0.2 * moment, 0.01 * moment * time))
    assert si_backstep(of, structs.replace(gains, unit=None), unit) is of


def test_without_being_asked_it_is_off_and_with_a_gait_in_own_units_it_has_no_defaults():
    assert not Scene().c["backstep"]["on"]
    assert Scene("backstep={}").c["backstep"]["k_d2"] == 300.0
    whole = "backstep={margin=0.0,theta_l=70.0,k_d2=0.4,b_d2=0.02}"
    assert read_scenario("spatial/own", ["controller=any/steady", whole]).backstep is not None
    with pytest.raises(InputError, match=r"backstep.b_d2: expected a number in m g l √\(l/g\), as its gait counts"):
        read_scenario("spatial/own", ["controller=any/steady", "backstep={margin=0.0,theta_l=70.0,k_d2=0.4}"])
