"""Bipeds that move in the plane: what is recognised of them, and which are refused with the part that is another."""

from __future__ import annotations

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.files import folder
from biped.robot.anatomy import anatomy_of
from biped.robot.parts import places_of
from biped.robot.recognise import robot_of
from biped.robot.spec import parsed
from biped.scenario.robot import Described

WALKER = (folder("models") / "walker2d.xml").read_text()
SLIDES = '<joint name="root_z" class="root" type="slide" axis="0 0 1" limited="false" ref="1.21"/>'
PITCH = '<joint name="root_pitch" class="root" axis="0 1 0" limited="false"/>'
KNEE, ANKLE = '<joint name="left_knee"/>', '<joint name="left_ankle" range="-45 45"/>'
FOOT = '<geom name="left_foot" class="left" fromto="0 0 0 0.2 0 0" size="0.06"/>'


def anatomy(tmp_path, *changes: tuple[str, str]):
    text = WALKER
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    path = tmp_path / "walker.xml"
    path.write_text(text)
    model, robot = parsed(path, Described())[1], robot_of(path, Described())
    return model, robot, anatomy_of(model, robot)


def test_a_leg_has_one_hinge_of_the_hip_and_two_ends(tmp_path):
    model, robot, found = anatomy(tmp_path)
    assert robot.planar
    assert found.trunk == ()
    assert found.leg == pytest.approx(1.01)
    for leg, side in zip(found.legs, ("right", "left"), strict=True):
        names = [model.joint(joint).name if joint >= 0 else "" for joint in leg.joints]
        assert names == [f"{side}_hip", "", "", f"{side}_knee", f"{side}_ankle", ""]
        np.testing.assert_allclose(leg.sole, [[0.2, 0, -0.06]] * 2 + [[0, 0, -0.06]] * 2, atol=1e-9)
        assert np.abs(leg.zero).max() < 1e-9
        assert leg.length == pytest.approx(0.5)


def test_axes_may_point_either_way_and_zeros_be_anywhere(tmp_path):
    """Legs with one knee's axis turned over, and zeros where knees and ankles are bent by 0.3 rad."""
    changes = [(KNEE, '<joint name="left_knee" axis="0 1 0" range="-17 150"/>')]
    for side in ("left", "right"):
        for part, place, bent in (("shank", "0 0 -0.45", 17.188734), ("foot", "0 0 -0.5", -17.188734)):
            old = f'<body name="{side}_{part}" pos="{place}">'
            changes.append((old, old.replace(">", f' euler="0 {bent} 0">')))
    right, left = anatomy(tmp_path, *changes)[2].legs
    assert [right.sign[3], left.sign[3]] == [1.0, -1.0]
    assert [right.zero[3], left.zero[3]] == pytest.approx([0.3, -0.3])
    assert [right.zero[4], left.zero[4]] == pytest.approx([-0.3, -0.3])
    assert left.length == pytest.approx(0.5)


@pytest.mark.parametrize(("change", "words"), [
    ((SLIDES + "\n      " + PITCH, PITCH + "\n      " + SLIDES),
     "joint 'root_z' of the base turns with joint 'root_pitch'; expected slides first"),
    ((KNEE, '<joint name="left_knee" axis="0.1 -1 0"/>'), r"joint 'left_knee' turns about .* where a knee turns about"),
    ((KNEE, KNEE + '<joint name="left_twist" axis="0 0 1"/>'),
     r"hangs on 4 joints .*; expected one of the hip, a knee and an ankle: it moves in the plane"),
    ((FOOT, '<geom name="left_foot" class="left" type="sphere" size="0.06"/>'),
     "foot 'left_foot' touches the ground at a point; expected a toe and a heel"),
    ((ANKLE, '<joint name="left_ankle" type="slide" range="-45 45"/>'), "joint 'left_ankle' of foot .* is no hinge"),
    (('<motor name="left_knee" joint="left_knee"/>', ""), "joint 'left_knee' has no actuator"),
    ((KNEE, '<joint name="left_knee" range="0 150"/>'), "brings the shank 150 degrees forward and 0 back"),
])  # fmt: skip
def test_what_is_another_kind_is_refused_with_the_part(tmp_path, change, words):
    with pytest.raises(InputError, match=words):
        anatomy(tmp_path, change)


def test_the_recognised_sole_is_where_it_touches(tmp_path):
    import mujoco

    model, robot, found = anatomy(tmp_path)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    for leg, foot in zip(found.legs, robot.feet, strict=True):
        sole = data.xpos[leg.foot] + leg.sole @ data.xmat[leg.foot].reshape(3, 3).T
        low = places_of(data, foot)
        np.testing.assert_allclose(sorted(set(np.round(sole[:, 0], 9))), sorted(set(np.round(low[:, 0], 9))), atol=1e-6)
