"""Robots that are no bipeds of the law's kind: each is refused in a sentence that names the part."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from biped.base.errors import InputError
from biped.base.files import locate
from biped.cli.main import main
from biped.studies.run import plan_of
from tests.robot.edited import SIDES, Edit, built


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
    (unequal, "recognised 1 (left_foot), and of the other leg 'right_foot' is lowest, 0.1 m above it in the start"),
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


@pytest.mark.parametrize(("model", "words"), [
    ("humanoid", "foot 'right_shin' hangs on 4 joints"),
    ("scenarios/any/small.urdf", "'right_hip_roll', 'right_hip_pitch', 'right_knee' do not turn the thigh every way"),
])  # fmt: skip
def test_shipped_robots_of_another_kind_are_refused(model, words):
    with pytest.raises(InputError, match=words):
        plan_of("any/h1_walk", [f'model="{model}"'])
