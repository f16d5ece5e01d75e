"""What is torso, thigh, shank, foot and sole: by geometry, whatever joints are called and wherever their zeros are."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from biped.base.files import locate
from biped.ensemble.campaign import simulate
from biped.robot.anatomy import ANKLE, INVERSION, KNEE, anatomy_of
from biped.robot.parts import own_masses
from biped.robot.recognise import robot_of
from biped.studies.run import plan_of
from tests.robot.edited import SIDES, built


def test_the_parts_of_a_humanoid(tmp_path):
    model, robot, anatomy = built(tmp_path)
    assert model.body(anatomy.torso).name == "pelvis"
    assert np.array_equal(anatomy.axes, np.eye(3))
    assert len(anatomy.trunk) == 9
    assert anatomy.shared == 0
    assert anatomy.leg == pytest.approx(0.87)
    for side, leg in zip(SIDES, anatomy.legs, strict=True):
        names = [model.joint(joint).name if joint >= 0 else "" for joint in leg.joints]
        assert names == [f"{side}_{part}" for part in ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle")] + [""]
        assert [model.body(body).name for body in (leg.thigh, leg.shank, leg.foot)] == [
            f"{side}_{part}" for part in ("thigh", "shank", "foot")]  # fmt: skip
        # Knees and ankles of this file turn about +y: bent is positive there, negative as flexion counts.
        assert leg.sign[KNEE] == leg.sign[ANKLE] == -1.0
        inner = 0.04 if side == "right" else -0.04
        assert leg.sole == pytest.approx(np.array([[0.15, inner, -0.07], [0.15, -inner, -0.07], [-0.05, inner, -0.07],
                                                   [-0.05, -inner, -0.07]]))  # fmt: skip
    assert robot.feet[0].name.startswith("right")


@pytest.mark.parametrize("degrees", [-13.0, 7.0])
def test_angles_count_from_geometry_wherever_a_joint_has_its_zero(tmp_path, degrees):
    """The shank is built in bent: the knee is straight where its coordinate takes that back."""

    def bend(spec: mujoco.MjSpec) -> None:
        half = np.radians(degrees) / 2
        spec.body("right_shank").quat = [np.cos(half), 0.0, np.sin(half), 0.0]  # about +y, as the joint turns

    _, _, anatomy = built(tmp_path, bend)
    right, left = anatomy.legs
    assert np.degrees(right.zero[KNEE]) == pytest.approx(-degrees, abs=1e-3)
    assert left.zero[KNEE] == pytest.approx(0.0)
    assert right.zero[ANKLE] == pytest.approx(0.0), "the foot turned with the shank"
    assert right.height == pytest.approx(left.height)


def test_a_hip_may_have_its_axes_in_any_order_and_tilt(tmp_path):
    def tilt(spec: mujoco.MjSpec) -> None:
        for side in SIDES:
            spec.joint(f"{side}_hip_yaw").axis = [0.0, 0.7, 0.7]
            spec.joint(f"{side}_hip_pitch").axis = [0.0, 0.8, -0.6]

    _, _, anatomy = built(tmp_path, tilt)
    for leg in anatomy.legs:
        assert leg.axes == pytest.approx(np.eye(3), abs=1e-9)


def test_a_human_bends_as_flexion_counts():
    path = locate("models", "human3d", "model")
    model = mujoco.MjModel.from_xml_path(str(path))
    from biped.scenario.reading import read_scenario

    table = read_scenario("spatial/own").robot
    assert table is not None
    anatomy = anatomy_of(model, robot_of(path, table))
    for leg in anatomy.legs:
        assert np.array_equal(leg.sign, np.ones(6))
        assert np.array_equal(leg.zero, np.zeros(6))
        assert np.array_equal(leg.axes, np.eye(3))
        assert leg.joints[INVERSION] >= 0
    assert anatomy.leg == pytest.approx(0.954)


def table(spec: mujoco.MjSpec) -> None:
    """Something heavy that is fixed to the world."""
    spec.worldbody.add_body(name="table", pos=[3.0, 2.0, 0.5]).add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.5, 0.5, 0.5], contype=0, conaffinity=0)  # fmt: skip


def hand(spec: mujoco.MjSpec) -> None:
    """Something heavy that is moved by hand."""
    table(spec)
    spec.body("table").mocap = True


@pytest.mark.parametrize("edit", [table, hand])
def test_what_stands_beside_a_robot_is_no_part_of_it(tmp_path, edit):
    """Neither of its mass nor of its walk, by either law."""
    model, robot, _ = built(tmp_path, edit)
    assert own_masses(model, robot.base_number).sum() == pytest.approx(robot.mass)
    assert robot.mass < 60.0 < model.body_mass.sum()
    for scenario in ("any/h1_walk", "any/h1"):
        changes = ["randomise={}", "push=[]", "expect={}", "window={start=0.05}", "duration=0.3"]
        here, alone = (simulate(plan_of(scenario, [*changes, f'model="{name}"']).run(0))
                       for name in (tmp_path / "changed.xml", "h1"))  # fmt: skip
        np.testing.assert_allclose(here.q, alone.q, atol=1e-8)
