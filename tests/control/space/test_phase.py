"""The leg states in space are those of the plane."""

from __future__ import annotations

import numpy as np
import pytest

from biped.control.planar.tick import leg_states as in_the_plane
from biped.control.space.record import HEEL_END, KNEE, TOE_END
from biped.control.space.tick import leg_states
from tests.control.space.scene import Scene
from tests.ticks import Bench


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene()


@pytest.mark.parametrize("passing", [np.inf, 0.07, -0.07])
def test_of_the_same_legs_they_are_the_same(scene, passing):
    plane, space, rng, seen = Bench().c, scene.c, np.random.default_rng(4), set()
    for name in ("extended", "ahead", "late_stance"):
        space["sensing"][name] = plane["sensing"][name]
    before = space["sensing"]["passing"].copy()
    for c in (plane, space):
        c["sensing"]["passing"] = passing
    for _ in range(300):
        toe, heel = rng.integers(0, 2, (2, 2))
        knee, thigh = -0.1 * rng.random(2), rng.normal(0.0, 0.2, 2)
        q = np.zeros(9)
        for leg in range(2):
            q[4 + 3 * leg] = space["at"]["joint"][leg, KNEE] = knee[leg]
            plane["memory"]["believed"][2 * leg : 2 * leg + 2] = toe[leg], heel[leg]
            space["memory"]["believed"][2 * leg + TOE_END] = toe[leg]
            space["memory"]["believed"][2 * leg + HEEL_END] = heel[leg]
            plane["at"]["angle"][1 + 3 * leg], space["at"]["angle"][leg, 0] = thigh[leg], 0.5 * np.pi + thigh[leg]
        in_the_plane(plane, q)
        leg_states(space)
        assert tuple(plane["memory"]["phase"]) == tuple(space["memory"]["phase"])
        seen |= {(*pair,) for pair in zip(toe, heel, plane["memory"]["phase"], strict=True)}
    space["sensing"]["passing"] = before
    assert ((1, 0, 2) in seen) == (passing < 1.0), "a toe alone on the ground, and swinging"
    assert {state for _, _, state in seen} == {0, 1, 2, 3}
