"""The law for any biped, on the human in the plane: there it is the law of the plane, which has code of its own."""

from __future__ import annotations

import numpy as np
import pytest

from biped.ensemble.campaign import measured, simulate_planar
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from tests.control.space.any_scene import AnyScene
from tests.ticks import Bench

PUSHING = "controller=normal", "actuation.contacts=pushing", "actuation.torque_limit=150.0", "start.jitter=0.0"
TIE = 1e-3
"""Of the torques: forces that share what fewer could do have a tie broken by 1e-12 in the plane, by 1e-9 in space."""


@pytest.mark.parametrize("changes", [(), ("actuation.torque_limit=60.0",), ("actuation.pushing.braking=0.6",)])
def test_in_the_plane_it_is_the_law_of_the_plane(changes):
    s = read_scenario("level_normal", [*PUSHING, *changes])
    walk, plane = simulate_planar(Plan(s).run(0)), Bench(s)
    space = AnyScene("any/plane", *PUSHING, *changes)
    column, random = space.c["belief"]["column"], np.random.default_rng(1)
    there = column >= 0
    for row in range(0, len(walk.q), 97):
        q, v = walk.q[row], walk.v[row] + 0.2 * random.standard_normal(walk.v.shape[1])
        space.put(q, v)
        theirs, mine = plane.tick(q, v), space.torques()
        forces = np.zeros(len(v))
        forces[column[there]] = space.c["tick"]["Q_d"][there]
        np.testing.assert_allclose(forces, plane.c["tick"]["Q_d"], rtol=0.0, atol=1e-9 * np.abs(forces).max())
        assert space.c["memory"]["phase"].tolist() == plane.c["memory"]["phase"].tolist()
        assert np.abs(mine - theirs).max() <= TIE * max(1.0, np.abs(theirs).max())


@pytest.mark.parametrize("mechanics", ["compiled", "pinocchio"])
def test_its_own_mechanics_in_the_plane_are_mujoco_s(mechanics):
    own, engine = (AnyScene("any/plane", *PUSHING, f"control.mechanics={who}") for who in (mechanics, "engine"))
    random = np.random.default_rng(2)
    for _ in range(5):
        q, v = own.q + 0.05 * random.standard_normal(9), own.v + 0.5 * random.standard_normal(9)
        for scene in (own, engine):
            scene.put(q, v)
        np.testing.assert_allclose(own.torques(), engine.torques(), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("gait", ["any/short", "any/long"])
def test_gaits_of_the_human_in_space_walk_it_in_the_plane(gait):
    changes = [f'controller="{gait}"', "start.jitter=0.0"]
    numbers = measured(Plan(read_scenario("any/plane", changes)).run(0))[1]
    assert numbers["walked"]
    assert 0.8 < numbers["speed"] < 1.0


def test_a_share_of_the_forces_themselves_is_said_to_come_from_outside():
    """Or else the sentinel of momentum would call it a hand that holds the walker."""
    changes = ["controller=any/long", "duration=2.0", "actuation.mode=generalized"]
    numbers = measured(Plan(read_scenario("any/plane", changes)).run(0))[1]
    assert not numbers["doubtful"]
    assert not numbers["diverged"]
