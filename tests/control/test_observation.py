"""What a law of any robot asks for, against MuJoCo's own functions."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.control.observation import Observation
from biped.ensemble.plan import Plan
from biped.robot.build import compiled
from biped.scenario.reading import read_scenario
from tests.engines.test_mujoco import named


@pytest.mark.parametrize("model", ["h1", "walker2d", "humanoid"])
def test_the_jacobian_of_all_contact_points_is_mujocos_point_by_point(model):
    run = Plan(read_scenario(named(model))).run(0)
    stepped = compiled(run.model, run.scenario, "torque")
    data = mujoco.MjData(stepped)
    mujoco.mj_integratePos(stepped, data.qpos, 0.3 * np.sin(1.0 + np.arange(stepped.nv)), 1.0)
    mujoco.mj_forward(stepped, data)
    sensed = Observation(stepped, data, run.robot)
    bodies = [body for foot in run.robot.feet for body in foot.on]
    expected = np.zeros((len(bodies), 3, stepped.nv))
    for rows, body, place in zip(expected, bodies, sensed.points, strict=True):
        mujoco.mj_jac(stepped, data, rows, None, place, body)
    np.testing.assert_array_equal(sensed.J, expected.reshape(-1, stepped.nv))
