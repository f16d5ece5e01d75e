"""Starts on slopes: upright bodies, feet where they were on level ground."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.ensemble.plan import Plan
from biped.robot.ground import frame
from biped.scenario.reading import read_scenario

SLOPES = [(3.0, 0.0), (-5.0, 0.0), (0.0, 3.0), (0.0, -5.0), (2.0, -2.0)]


def start(slope, side, posture, upright):
    changes = [f"ground.slope={slope}", f"ground.side_slope={side}", f"start.posture={posture}"]
    changes += ["start.jitter=0.0", f"start.upright={str(upright).lower()}"]
    return Plan(read_scenario("spatial/own", changes)).run(0)


def points_of(run):
    """(8, 3) [m] of the soles' sites."""
    model = mujoco.MjModel.from_xml_path(str(locate("models", "human3d", "model")))
    data = mujoco.MjData(model)
    data.qpos[:] = run.q
    mujoco.mj_kinematics(model, data)
    return data.site_xpos.copy()


def turn_of(q):
    w, x, y, z = q[3:7]
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def turn_of_base(run):
    """(3, 3) of the planar human's torso."""
    model = mujoco.MjModel.from_xml_path(str(locate("models", "human", "model")))
    data = mujoco.MjData(model)
    data.qpos[:] = run.q
    mujoco.mj_kinematics(model, data)
    return data.xmat[1].reshape(3, 3).copy()


@pytest.mark.parametrize(("slope", "side"), SLOPES)
@pytest.mark.parametrize("posture", ["heel_toe", "flat", "single"])
def test_the_body_is_as_upright_and_feet_are_where_they_were(slope, side, posture):
    level, stood = start(0.0, 0.0, posture, True), start(slope, side, posture, True)
    np.testing.assert_allclose(turn_of(stood.q), frame(slope, side) @ turn_of(level.q), atol=1e-12)
    before, after = points_of(level), points_of(stood)
    assert np.abs(after - before).max() < 0.03  # it is set down, and a stretched leg may not reach
    assert after[:, 2].min() == pytest.approx(0.0, abs=2e-6)
    assert np.array_equal(stood.v, level.v)
    assert (stood.q[[10, 16]] <= 0.0).all()  # knees


def test_on_level_ground_nothing_changes():
    assert np.array_equal(start(0.0, 0.0, "flat", True).q, start(0.0, 0.0, "flat", False).q)


def test_the_law_of_the_plane_alone_has_none():
    with pytest.raises(InputError, match=r"start\.upright: expected false.*plane"):
        Plan(read_scenario("level_normal", ["start.upright=true"])).run(0)


@pytest.mark.parametrize("slope", [3.0, -5.0])
@pytest.mark.parametrize("posture", ["heel_toe", "flat", "single"])
def test_a_robot_in_the_plane_stands_up_too(slope, posture):
    level, stood = (
        Plan(read_scenario("any/plane", [f"start.posture={posture}", "start.jitter=0.0", f"ground.slope={at}",
                                         "start.upright=true"])).run(0)
        for at in (0.0, slope)
    )  # fmt: skip
    model = mujoco.MjModel.from_xml_path(str(locate("models", "human", "model")))
    places = []
    for run in (level, stood):
        data = mujoco.MjData(model)
        data.qpos[:] = run.q
        mujoco.mj_kinematics(model, data)
        places.append(data.site_xpos[[model.site(f"{leg}_{end}").id for leg in ("right", "left")
                                      for end in ("toe", "heel")]].copy())  # fmt: skip
        turn = data.xmat[1].reshape(3, 3)
        np.testing.assert_allclose(frame(run.scenario.ground.slope, 0.0).T @ turn, turn_of_base(level), atol=1e-12)
    assert np.abs(places[1] - places[0]).max() < 0.03
    assert places[1][:, 2].min() == pytest.approx(0.0, abs=2e-6)


def test_a_slope_beyond_reach_is_said_so():
    with pytest.raises(InputError, match=r"start\.upright: the legs cannot reach"):
        start(35.0, 0.0, "heel_toe", True)
