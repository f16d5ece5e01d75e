"""What is torso, thigh, shank, foot and sole: by geometry, whatever joints are called and wherever their zeros are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.cli.main import main
from biped.ensemble.campaign import simulate
from biped.robot.anatomy import ANKLE, INVERSION, KNEE, anatomy_of
from biped.robot.parts import own_masses
from biped.robot.posture import borrow, borrowed_names
from biped.robot.recognise import robot_of
from biped.robot.sole import height_over_rest
from biped.scenario.robot import Described
from biped.studies.run import plan_of

Edit = Callable[[mujoco.MjSpec], object]
SIDES = ("right", "left")


def nothing(spec: mujoco.MjSpec) -> None:
    """Leaves it as it is."""


def built(folder: Path, edit: Edit = nothing, model: str = "h1"):
    """A shipped robot with some part of it changed: its model, what is recognised, its anatomy."""
    spec = mujoco.MjSpec.from_file(str(locate("models", model, "model")))
    edit(spec)
    path = folder / "changed.xml"
    path.write_text(spec.to_xml())
    robot = robot_of(path, Described())
    compiled = mujoco.MjModel.from_xml_path(str(path))
    return compiled, robot, anatomy_of(compiled, robot)


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


def joint(name: str, **changes) -> Edit:
    """Changes something of a joint."""

    def edit(spec: mujoco.MjSpec) -> None:
        for key, value in changes.items():
            setattr(spec.joint(name), key, value)

    return edit


def more(body: str, **joint_of) -> Edit:
    """Gives a body one more joint, which is driven."""

    def edit(spec: mujoco.MjSpec) -> None:
        for key in list(spec.keys):
            spec.delete(key)
        if body == "right_toe_cap":
            spec.body("right_foot").add_body(name=body, mass=0.1, ipos=[0.0, 0.0, 0.0], inertia=[1e-4] * 3)
        spec.body(body).add_joint(name="more", **joint_of)
        spec.add_actuator(name="more", target="more", trntype=mujoco.mjtTrn.mjTRN_JOINT)

    return edit


def without(*joints: str) -> Edit:
    """Takes joints with their actuators away."""

    def edit(spec: mujoco.MjSpec) -> None:
        for key in list(spec.keys):
            spec.delete(key)
        for name in joints:
            spec.delete(next(one for one in spec.actuators if one.target == name))
            spec.delete(spec.joint(name))

    return edit


def undriven(name: str) -> Edit:
    """Takes an actuator away."""
    return lambda spec: spec.delete(next(one for one in spec.actuators if one.target == name))


def sole(**changes) -> Edit:
    """Changes the geom of the right sole."""

    def edit(spec: mujoco.MjSpec) -> None:
        for key, value in changes.items():
            setattr(spec.geom("right_sole"), key, value)

    return edit


def toes(spec: mujoco.MjSpec) -> None:
    """Gives the right foot toes, which touch the ground too."""
    body = spec.body("right_foot").add_body(name="right_toes", pos=[0.16, 0.0, 0.0])
    body.add_joint(name="right_toe", axis=[0.0, 1.0, 0.0])
    body.add_geom(name="toes", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.02, 0.04, 0.015], pos=[0.0, 0.0, -0.055],
                  contype=1, conaffinity=1)  # fmt: skip
    spec.add_actuator(name="right_toe", target="right_toe", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    for key in list(spec.keys):
        spec.delete(key)


def linkage(spec: mujoco.MjSpec) -> None:
    """Closes a loop over the right knee."""
    spec.add_equality(name="rod", type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_BODY,
                      name1="right_thigh", name2="right_foot", data=[0.0, 0.0, -0.4, *[0.0] * 9])  # fmt: skip


def coupled(spec: mujoco.MjSpec) -> None:
    """Couples the right knee and ankle."""
    spec.add_equality(name="belt", type=mujoco.mjtEq.mjEQ_JOINT, name1="right_knee", name2="right_ankle",
                      data=[0.0, 1.0, *[0.0] * 10])  # fmt: skip


BALL, SLIDE = mujoco.mjtJoint.mjJNT_BALL, mujoco.mjtJoint.mjJNT_SLIDE


def welded(spec: mujoco.MjSpec) -> None:
    """The feet are one."""
    spec.add_equality(type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1="right_foot",
                      name2="left_foot", data=[0.0] * 6 + [1.0] + [0.0] * 3 + [1.0, 0.0])  # fmt: skip


def backward(spec: mujoco.MjSpec) -> None:
    """It faces the other way."""
    spec.body("pelvis").quat = [0.0, 0.0, 0.0, 1.0]


def ball(spec: mujoco.MjSpec) -> None:
    """The right hip is a ball."""
    without("right_hip_yaw", "right_hip_roll", "right_hip_pitch")(spec)
    spec.body("right_thigh").add_joint(name="right_hip", type=BALL)


def no_thigh(spec: mujoco.MjSpec) -> None:
    """The right knee is where the hip is."""
    spec.body("right_shank").pos = [0.0, 0.0, 0.0]
    spec.body("right_hip_yaw").pos += [0.0, 0.0, -0.4]


def high_soles(spec: mujoco.MjSpec) -> None:
    """It stands on plates above its hips."""
    for side in SIDES:
        spec.geom(f"{side}_sole").pos = [0.05, 0.0, 0.9]


@pytest.mark.parametrize(("edit", "words"), [
    (without("right_ankle"), "foot 'right_foot' hangs on 4 joints .* expected three of the hip, a knee"),
    (without("right_hip_yaw", "left_hip_yaw"), "foot 'right_foot' hangs on 4 joints"),
    (without("right_hip_yaw", "right_hip_roll"), "foot 'right_foot' hangs on 3 joints"),
    (more("right_shank", axis=[0.0, 0.0, 1.0]), "joint 'more' does not turn the sole inward"),
    (more("right_thigh", axis=[0.0, 0.0, 1.0]), "joint 'more' turns about .* where a knee turns about the lateral"),
    (joint("right_knee", axis=[1.0, 0.0, 0.0]), "joint 'right_knee' turns about .* where a knee turns"),
    (joint("left_ankle", axis=[1.0, 0.0, 0.0]), "joint 'left_ankle' turns about .* where an ankle turns"),
    (joint("right_hip_yaw", axis=[0.0, 1.0, 0.0]), "the hip's joints 'right_hip_yaw', .* do not turn the thigh"),
    (joint("right_knee", type=SLIDE), "joint 'right_knee' of foot 'right_foot' is no hinge"),
    (undriven("torso"), "joint 'torso' has no actuator"),
    (undriven("right_ankle"), "joint 'right_ankle' has no actuator"),
    (toes, "body 'right_toes' of foot 'right_foot' moves against 'right_foot'; expected a stiff sole"),
    (more("right_toe_cap", axis=[0.0, 1.0, 0.0]), "joint 'more' hangs on the right leg beside its own"),
    (linkage, "<equality> 'rod' closes a linkage"),
    (coupled, "<equality> 'belt' closes a linkage"),
    (sole(margin=0.01), "geom '.*right_sole' of foot 'right_foot' has a margin by which the ground bears it"),
    (welded, "<equality> number 1 closes a linkage"),
    (backward, "joint 'left_knee' brings the shank 117 degrees forward and 15 back; expected a knee of a"),
    (sole(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.015, 0.0, 0.0]), "touches the ground along a line or at a point"),
    (sole(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[0.02, 0.08, 0.0], quat=[0.7071, 0.0, 0.7071, 0.0]),
     "touches the ground along a line or at a point"),
    (sole(size=[0.1, 1e-9, 0.015]), "foot 'right_foot' touches the ground along a line or at a point"),
    (ball, "joint 'right_hip' of foot 'right_foot' is no hinge"),
    (joint("right_knee", range=[-2.05, 0.26]), "joint 'right_knee' brings the shank 117 degrees forward"),
    (joint("right_knee", range=[-0.001, 0.001]), "joint 'right_knee' bends the shank by 0.11 degrees"),
    (no_thigh, "joint 'right_knee' has the axis of joint 'right_hip_pitch'; expected a thigh between them"),
    (high_soles, "foot 'right_foot' has its sole above joint 'right_ankle'; expected it below"),
])  # fmt: skip
def test_another_robot_is_refused_in_a_sentence_that_names_the_part(tmp_path, edit, words):
    with pytest.raises(InputError, match=words) as refused:
        built(tmp_path, edit)
    said = str(refused.value)
    assert said.startswith("law: 'thesis' is not for model 'changed': "), said
    assert "\n" not in said


def without_keys(spec: mujoco.MjSpec) -> None:
    """Takes postures away: they fit no robot of other joints."""
    for key in list(spec.keys):
        spec.delete(key)


def one_leg(spec: mujoco.MjSpec) -> None:
    """It has the right leg alone."""
    without(*(f"left_{name}" for name in ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle")))(spec)
    spec.delete(spec.body("left_hip_yaw"))


def third_leg(spec: mujoco.MjSpec) -> None:
    """It has a third foot, on a leg of its own."""
    without_keys(spec)
    leg = spec.body("pelvis").add_body(name="middle_leg", pos=[-0.3, 0.0, -0.1742])
    leg.add_joint(name="middle_hip", axis=[0.0, 1.0, 0.0])
    leg.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 0.04, 0.015], pos=[0.0, 0.0, -0.855], contype=1,
                 conaffinity=1)  # fmt: skip
    spec.add_actuator(name="middle_hip", target="middle_hip", trntype=mujoco.mjtTrn.mjTRN_JOINT)


def bare(spec: mujoco.MjSpec) -> None:
    """Nothing of its feet touches the ground."""
    for side in SIDES:
        geom = spec.geom(f"{side}_sole")
        geom.contype = geom.conaffinity = 0


def unequal(spec: mujoco.MjSpec) -> None:
    """Its right leg is shorter."""
    spec.body("right_shank").pos = [0.0, 0.0, -0.3]


def held(spec: mujoco.MjSpec) -> None:
    """Its pelvis is fixed to the world."""
    without_keys(spec)
    spec.delete(spec.joint("root"))


def limp(spec: mujoco.MjSpec) -> None:
    """It has no motors."""
    without_keys(spec)
    for one in list(spec.actuators):
        spec.delete(one)


def idle(spec: mujoco.MjSpec) -> None:
    """The motor of the right knee has no gear."""
    next(one for one in spec.actuators if one.target == "right_knee").gear = [0.0] * 6


def twice(spec: mujoco.MjSpec) -> None:
    """The right knee has two motors."""
    without_keys(spec)
    spec.add_actuator(name="second", target="right_knee", trntype=mujoco.mjtTrn.mjTRN_JOINT)


@pytest.mark.parametrize(("edit", "words"), [
    (one_leg, "feet: expected two, recognised 1 (right_foot)"),
    (third_leg, "feet: expected two, recognised 3 (left_foot, right_foot, middle_leg)"),
    (bare, "feet: no geom can touch the ground"),
    (unequal, "feet: expected two, recognised 1 (left_foot)"),
    (held, "base: nothing moves freely; write <freejoint/> in body 'pelvis'"),
    (limp, "actuators: none"),
    (idle, "actuator 'right_knee': gear 0 moves nothing"),
    (twice, "actuators: joint 'right_knee' has several"),
])  # fmt: skip
def test_what_is_no_biped_is_refused_by_every_command(tmp_path, capsys, edit, words):
    spec, path = mujoco.MjSpec.from_file(str(locate("models", "h1", "model"))), tmp_path / "changed.xml"
    edit(spec)
    path.write_text(spec.to_xml())
    refused_by_every_command(path, capsys, words)


@pytest.mark.parametrize(("old", "new", "words"), [
    ('mass="1.721"', 'mass="0"', "mass and inertia of moving bodies must be larger"),
    ('size="0.1 0.04 0.015"', 'size="0 0 0"', "size 0 must be positive in geom"),
])  # fmt: skip
def test_shanks_without_mass_and_soles_without_size_are_refused_in_mujocos_words(tmp_path, capsys, old, new, words):
    path = tmp_path / "changed.xml"
    path.write_text(locate("models", "h1", "model").read_text().replace(old, new))
    refused_by_every_command(path, capsys, words)


def refused_by_every_command(path: Path, capsys, words: str) -> None:
    """In one sentence, whoever asks."""
    assert main(["run", "any/cells/level", "--set", f'model="{path}"']) == 2
    said = capsys.readouterr().err.strip()
    assert words in said
    assert "\n" not in said
    assert main(["model", str(path)]) in (1, 2)
    out, err = capsys.readouterr()
    assert words in " ".join(f"{out} {err}".split())


def shoe(spec: mujoco.MjSpec) -> None:
    """Gives both feet a mesh with a rim 12 mm above what it stands on, which is 5 mm lower than the soles were."""
    rims = [[[x, y, z] for x in xs for y in ys] for xs, ys, z in (
        ((-0.05, 0.16), (-0.045, 0.045), 0.012), ((-0.04, 0.14), (-0.035, 0.035), 0.0),
        ((-0.05, 0.16), (-0.045, 0.045), 0.04))]  # fmt: skip
    spec.add_mesh(name="shoe", uservert=np.array(rims).ravel().tolist())
    for side in SIDES:
        geom = spec.geom(f"{side}_sole")
        geom.type, geom.meshname, geom.pos = mujoco.mjtGeom.mjGEOM_MESH, "shoe", [0.0, 0.0, -0.075]


def test_a_sole_of_a_mesh_is_what_it_rests_on(tmp_path):
    _, _, anatomy = built(tmp_path, shoe)
    for leg in anatomy.legs:
        assert np.abs(leg.sole) == pytest.approx(np.array([[0.14, 0.035, 0.075]] * 2 + [[0.04, 0.035, 0.075]] * 2))
        assert leg.sole[:, 2] == pytest.approx(-0.075)


def balls(radius: float, corners: np.ndarray) -> Edit:
    """Puts four spheres below both feet, about centres (4, 3) [m] in the frame of a foot."""

    def edit(spec: mujoco.MjSpec) -> None:
        for side in SIDES:
            for number, place in enumerate(corners):
                foot = spec.body(f"{side}_foot")
                foot.add_geom(name=f"{side}_{number}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0.0, 0.0],
                              pos=place, contype=1, conaffinity=1)  # fmt: skip

    return edit


BALLS = np.array([[0.13, 0.03, -0.0725], [0.13, -0.03, -0.0725], [-0.04, 0.03, -0.0725], [-0.04, -0.03, -0.0725]])


def test_spheres_below_a_plate_are_the_sole(tmp_path):
    """As R1's: the plate reaches further out than the spheres on which the robot stands."""
    _, robot, anatomy = built(tmp_path, balls(0.01, BALLS))
    assert len(robot.feet[0].points) == 8
    for leg in anatomy.legs:
        assert np.abs(leg.sole) == pytest.approx(np.array([[0.13, 0.03, 0.0825]] * 2 + [[0.04, 0.03, 0.0825]] * 2))


def tilted(slope: float) -> Edit:
    """Feet of four large spheres whose plane is tilted where the ankles have their zero."""
    turn = np.array([[np.cos(slope), 0.0, np.sin(slope)], [0.0, 1.0, 0.0], [-np.sin(slope), 0.0, np.cos(slope)]])

    def edit(spec: mujoco.MjSpec) -> None:
        for side in SIDES:
            plate = spec.geom(f"{side}_sole")
            plate.contype = plate.conaffinity = 0
        balls(0.03, BALLS @ turn.T)(spec)

    return edit


def test_large_spheres_touch_with_what_is_lowest_when_the_foot_is_flat(tmp_path):
    _, _, anatomy = built(tmp_path, tilted(0.1))
    for leg in anatomy.legs:
        depth = leg.sole @ [np.sin(0.1), 0.0, np.cos(0.1)]
        assert depth == pytest.approx(-0.0725 - 0.03, abs=1e-6)


def cylinders(height: float, radius: float, quat: list[float], places: np.ndarray) -> Edit:
    """Feet of cylinders."""

    def edit(spec: mujoco.MjSpec) -> None:
        for side in SIDES:
            foot = spec.body(f"{side}_foot")
            for geom in list(foot.geoms):
                spec.delete(geom)
            for place in places:
                foot.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[radius, 0.5 * height, 0.0], quat=quat,
                              pos=place, contype=0, conaffinity=1)  # fmt: skip

    return edit


@pytest.mark.parametrize("roll", [0.0, 30.0, 45.0, 90.0])
def test_lying_cylinders_touch_along_their_lowest_lines_however_they_are_rolled(tmp_path, roll):
    """Axis along x, rolled about itself, which changes no physics."""
    laid, rolled, quat = np.zeros(4), np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(laid, np.array([0.0, 1.0, 0.0]), 0.5 * np.pi)
    mujoco.mju_axisAngle2Quat(rolled, np.array([0.0, 0.0, 1.0]), np.deg2rad(roll))
    mujoco.mju_mulQuat(quat, laid, rolled)
    two = np.array([[0.05, y, -0.05] for y in (0.03, -0.03)])
    _, robot, anatomy = built(tmp_path, cylinders(0.2, 0.02, list(quat), two))
    ends = sorted((x, y, -0.07) for x in (-0.05, 0.15) for y in (-0.03, 0.03))
    for foot, leg in zip(robot.feet, anatomy.legs, strict=True):
        np.testing.assert_allclose(sorted(map(tuple, np.round(foot.points, 9))), ends, atol=1e-8)
        np.testing.assert_allclose(sorted(map(tuple, np.round(leg.sole, 9))), ends, atol=1e-8)


@pytest.mark.parametrize("turned", [0.0, 20.0, 45.0])
def test_a_standing_disc_has_four_corners_however_it_is_turned(tmp_path, turned):
    quat = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quat, np.array([0.0, 0.0, 1.0]), np.deg2rad(turned))
    _, _, anatomy = built(tmp_path, cylinders(0.02, 0.08, list(quat), np.array([[0.05, 0.0, -0.06]])))
    reach = 0.08 * np.sqrt(0.5)
    corners = sorted((0.05 + x, y, -0.07) for x in (-reach, reach) for y in (-reach, reach))
    for leg in anatomy.legs:
        np.testing.assert_allclose(sorted(map(tuple, np.round(leg.sole, 9))), corners, atol=1e-8)


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


def test_a_foot_that_is_excluded_from_the_ground_is_none(tmp_path):
    def edit(spec: mujoco.MjSpec) -> None:
        spec.add_exclude(bodyname1="world", bodyname2="left_foot")

    with pytest.raises(InputError, match="expected two, recognised 1"):
        built(tmp_path, edit)


def test_a_constraint_that_is_not_active_closes_nothing(tmp_path):
    def edit(spec: mujoco.MjSpec) -> None:
        linkage(spec)
        spec.equalities[0].active = False

    built(tmp_path, edit)


@pytest.mark.parametrize("tilt", [0.0, 0.05, -0.1])
def test_what_rests_on_a_plane_has_no_height_over_it(tilt):
    """A plate with a bump above it and a rim: its corners are at zero, the rest at its distance, tilted or not."""
    points = np.array([[0.1, 0.05, 0.0], [0.1, -0.05, 0.0], [-0.1, 0.05, 0.0], [-0.1, -0.05, 0.0], [0.12, 0.06, 0.004],
                       [-0.12, 0.0, 0.01], [0.0, 0.0, 0.03]])  # fmt: skip
    raised = points + np.column_stack([np.zeros((7, 2)), tilt * points[:, 0] + 0.3])
    assert height_over_rest(raised) == pytest.approx(points[:, 2], abs=1e-12)


@pytest.mark.parametrize(("model", "words"), [
    ("humanoid", "foot 'right_shin' hangs on 4 joints"),
    ("scenarios/any/small.urdf", "'right_hip_roll', 'right_hip_pitch', 'right_knee' do not turn the thigh every way"),
])  # fmt: skip
def test_shipped_robots_of_another_kind_are_refused(model, words):
    with pytest.raises(InputError, match=words):
        plan_of("any/h1_walk", [f'model="{model}"'])
