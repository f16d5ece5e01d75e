"""What the law reads of the walker against Pinocchio's."""

from __future__ import annotations

import numpy as np
import pytest

from tests.control.space.scene import Referee, Scene, states


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene()


@pytest.mark.parametrize("number", range(5))
def test_mass_matrix_points_and_centre_are_pinocchios(scene, number):
    q, v = states(scene, 5)[number]
    scene.sensed(q, v)
    referee, at = Referee(q, v), scene.c["at"]
    assert np.abs(scene.M() - referee.M).max() < 1e-12 * referee.M.max()
    assert np.abs(scene.mechanics.h - referee.h).max() < 1e-12 * np.abs(referee.h).max()
    names = [f"{foot.name}_{end}" for foot in scene.robot.feet
             for end in ("toe_inner", "toe_outer", "heel_inner", "heel_outer")]  # fmt: skip
    for i, name in enumerate(names):
        J, bias = referee.point(name)
        assert np.abs(scene.J(i) - J[[2, 0, 1]]).max() < 1e-12
        assert np.abs(at["bias"][i] - bias[[2, 0, 1]]).max() < 1e-12 * max(1.0, np.abs(bias).max())
        assert at["speed"][i] == pytest.approx(float((J @ v)[2]), abs=1e-12)
    place, velocity = referee.com()
    assert np.abs(at["com"] - place).max() < 1e-12
    assert np.abs(at["com_velocity"] - velocity).max() < 1e-12


def test_angles_are_those_of_the_links_against_the_frame_that_heads_where_it_is_told(scene):
    q, v = scene.q.copy(), np.zeros(18)
    turn = np.radians(20.0)
    q[3:7] = np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2)  # upright, turned to the left
    q[7:] = [0.3, 0.1, 0.0, -0.4, 0.1, 0.0, -0.2, 0.15, 0.0, -0.1, 0.0, 0.0]
    scene.c["gait"]["heading"] = turn
    scene.sensed(q, v)
    at = scene.c["at"]
    scene.c["gait"]["heading"] = 0.0
    assert at["torso"] == pytest.approx([np.pi / 2, 0.0, 0.0], abs=1e-12)
    # A hip flexed by 0.3 and then abducted by 0.1: the thigh's axis seen from the side and from ahead.
    for leg, (flexed, abducted) in enumerate(((0.3, 0.1), (-0.2, 0.15))):
        assert at["angle"][leg, 0] == pytest.approx(np.pi / 2 + flexed)
        assert np.tan(at["angle"][leg, 1]) == pytest.approx(np.tan(abducted) / np.cos(flexed))
