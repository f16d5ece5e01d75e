"""Gaits in units of their walker: the human's gaits in them are the human's gaits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from biped.control.space.setup import Unit, controller_record, si_gains, si_pushing, unit_of
from biped.control.space.tick import spatial_tick
from biped.robot.anatomy import anatomy_of
from biped.scenario.gains import MGL, Pace
from tests.control.space.scene import Scene, states


class Inverse:
    """One over a unit: what is in it becomes what is counted in the unit."""

    def __init__(self, unit):
        self._unit = unit

    def __getattr__(self, name):
        return 1.0 / getattr(self._unit, name)


def own_gains(gains, unit):
    """A gait in SI units, in units of its walker."""
    return structs.replace(si_gains(structs.replace(gains, unit=MGL), Inverse(unit)), unit=MGL)


def own_pushing(pushing, gains, unit):
    """Settings of ground that only pushes, likewise."""
    assert gains.unit is None
    return si_pushing(pushing, structs.replace(gains, unit=MGL), Inverse(unit))


@pytest.mark.parametrize("controller", ["human3d", "human3d_sure", "human3d_steady"])
def test_the_humans_gait_gives_the_same_torques_in_its_own_units(controller):
    scene = Scene(
        f'controller="{controller}"',
        "gains.pace={speed=0.9,slope=2.0,side=0.1,swing=0.2,stance=0.1,knee=9.0,ankle=50.0}",
    )
    setup = scene.setup
    unit = unit_of(scene.robot, anatomy_of(scene.model, scene.robot))
    assert unit == Unit(pytest.approx(75.0), pytest.approx(0.954))
    s = setup.scenario
    pushing = own_pushing(s.actuation.pushing, setup.gains, unit)
    scenario = structs.replace(s, actuation=structs.replace(s.actuation, pushing=pushing))
    own = controller_record(replace(setup, scenario=scenario, gains=own_gains(setup.gains, unit)))
    for q, v in states(scene, 10):
        scene.put(q, v)
        scene.data.qpos[2] -= scene.data.geom_xpos[scene.points, 2].min()
        scene.put(scene.data.qpos.copy(), v)
        for record in (scene.record, own):
            spatial_tick(record, scene.mechanics, True)
        mine, theirs = own[0]["tick"], scene.record[0]["tick"]
        assert mine["Q_d"] == pytest.approx(theirs["Q_d"], rel=1e-9, abs=1e-9)
        assert mine["u"] == pytest.approx(theirs["u"], rel=1e-9, abs=1e-9 * np.abs(theirs["u"]).max())


def test_units_are_those_of_the_dimensions():
    """A walker of twice the length and eight times the mass: moments grow 16-fold, times by the root of 2."""
    scene = Scene()
    gains = structs.replace(scene.setup.gains, pace=Pace(0.9, 2.0, 0.1, 0.2, 0.1, 1.2, 9.0, 50.0))
    placement = structs.replace(gains.frontal.placement, apart=0.15, crossing=0.1, shorten=0.5, push=0.02)
    gains = structs.replace(gains, frontal=structs.replace(gains.frontal, placement=placement))
    small, large = Unit(10.0, 0.5), Unit(80.0, 1.0)
    one, other = (si_gains(own_gains(gains, small), unit) for unit in (small, large))
    assert one.k_d1 == pytest.approx(gains.k_d1)
    assert other.k_d1 == pytest.approx(16.0 * gains.k_d1)
    assert other.b_d2 == pytest.approx([16.0 * 2.0**0.5 * b for b in gains.b_d2])
    assert other.theta_l == gains.theta_l
    placed, mine = other.frontal.placement, gains.frontal.placement
    # Degrees for a distance of one leg, or a speed of √(g l), are the same.
    assert placed.position * large.length == pytest.approx(mine.position * small.length)
    assert (placed.apart, placed.crossing, placed.shorten) == pytest.approx((0.3, 0.2, 0.5))
    speed = [(9.81 * unit.length) ** 0.5 for unit in (large, small)]
    assert placed.velocity * speed[0] == pytest.approx(mine.velocity * speed[1])
    assert placed.push == pytest.approx(0.02)  # that for an acceleration of g
    # So are those for a speed above the gait's pace, which is so many √(g l).
    assert other.pace.speed / speed[0] == pytest.approx(gains.pace.speed / speed[1])
    assert other.pace.slope / other.pace.speed == pytest.approx(gains.pace.slope / gains.pace.speed)
    assert other.pace.swing * other.pace.speed == pytest.approx(gains.pace.swing * gains.pace.speed)
    assert other.pace.stance * other.pace.speed == pytest.approx(gains.pace.stance * gains.pace.speed)
    assert other.pace.lean == gains.pace.lean
    assert other.pace.ankle * speed[0] ** 2 == pytest.approx(16.0 * gains.pace.ankle * speed[1] ** 2)
    assert other.pace.knee * speed[0] ** 2 == pytest.approx(16.0 * gains.pace.knee * speed[1] ** 2)
    before = structs.replace(scene.setup.scenario.actuation.pushing, slew=1000.0)
    after = si_pushing(own_pushing(before, gains, small), own_gains(gains, small), large)
    assert after.approach == pytest.approx(2.0**0.5 * before.approach)
    assert after.reach == pytest.approx(2.0 * before.reach)
    assert after.yielding == pytest.approx(before.yielding)
    assert after.slew == pytest.approx(16.0 / 2.0**0.5 * before.slew)
    # ε |u|² against accelerations' work: 1/(kg m²).
    assert after.regularisation == pytest.approx(before.regularisation / 32.0)
