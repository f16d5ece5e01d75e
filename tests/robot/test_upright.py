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


@pytest.mark.parametrize(("scenario", "more"), [("level_normal", []), ("any/human", ["ground.slope=2.0"])])
def test_it_is_for_free_bases(scenario, more):
    with pytest.raises(InputError, match=r"start\.upright: expected false.*plane"):
        Plan(read_scenario(scenario, ["start.upright=true", *more])).run(0)


def test_a_slope_beyond_reach_is_said_so():
    with pytest.raises(InputError, match=r"start\.upright: the legs cannot reach"):
        start(35.0, 0.0, "heel_toe", True)
