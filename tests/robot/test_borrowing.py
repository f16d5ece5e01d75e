"""Postures of the human that another biped takes over: its angles, in the biped's own time."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.base.files import locate
from biped.robot.borrowing import borrow, borrowed_names
from tests.robot.edited import SIDES, built


def test_a_borrowed_posture_is_the_humans_angles_in_its_own_time(tmp_path):
    model, robot, anatomy = built(tmp_path)
    human = mujoco.MjModel.from_xml_path(str(locate("models", "human3d", "model")))
    theirs, data = mujoco.MjData(human), mujoco.MjData(model)
    assert set(borrowed_names()) == {"heel_toe", "flat", "single", "stand", "stride"}
    for name in ("heel_toe", "flat", "single"):
        mujoco.mj_resetDataKeyframe(human, theirs, human.key(name).id)
        borrow(model, data, robot, name)
        for who, state in ((human, theirs), (model, data)):
            mujoco.mj_forward(who, state)
        assert data.body("pelvis").xmat == pytest.approx(theirs.body("torso").xmat, abs=1e-9)
        pace = np.sqrt(0.954 / anatomy.leg)
        for side in SIDES:
            assert data.body(f"{side}_thigh").xmat == pytest.approx(theirs.body(f"{side}_thigh").xmat, abs=1e-9)
            turning, mine = np.empty(6), np.empty(6)
            for who, state, out in ((human, theirs, turning), (model, data, mine)):
                mujoco.mj_objectVelocity(who, state, mujoco.mjtObj.mjOBJ_XBODY, who.body(f"{side}_thigh").id, out, 0)
            assert mine[:3] == pytest.approx(pace * turning[:3], abs=1e-6)
            assert -data.joint(f"{side}_knee").qpos[0] == pytest.approx(min(theirs.joint(f"{side}_knee").qpos[0], 0.24))
