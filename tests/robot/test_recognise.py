"""What a model file is, and every fault of one at once."""

from __future__ import annotations

import os
import re
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest

from biped.base.errors import InputError
from biped.base.trust import trusting
from biped.cli.main import main
from biped.control.observation import Observation
from biped.robot.build import compiled
from biped.robot.ground import frame, gravity, gravity3
from biped.robot.planar.model import tree_at
from biped.robot.recognise import looked_at, robot_of
from biped.scenario.reading import read_scenario
from biped.scenario.robot import Actuators, Base, Described, Foot
from biped.show.recording.scene import drawn_geoms
from tests.cases import command, write

MODELS = Path("models")

LEG = """
<body name="{s}_leg" pos="0 {y} -0.1">
  <joint name="{s}_hip" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.03" contype="0" conaffinity="0"/>
  <body name="{s}_foot" pos="0 0 -0.45"><joint name="{s}_ankle" axis="0 1 0" damping="0.1"/>
    <geom name="{s}_sole" type="box" pos="0.02 0 -0.02" size="0.1 0.04 0.02"/></body>
</body>"""


def model(base: str = "<freejoint/>", actuators: str = "", world: str = "", keys: str = "") -> str:
    """A robot of a box and two legs."""
    legs = LEG.format(s="left", y=0.1) + LEG.format(s="right", y=-0.1)
    return f"""<mujoco><worldbody>{world}
<body name="trunk" pos="0 0 0.6">{base}<geom type="box" size="0.05 0.1 0.15" pos="0 0 0.1"/>{legs}</body></worldbody>
<actuator>{actuators}</actuator><keyframe>{keys}</keyframe></mujoco>"""


MOTORS = "".join(f'<motor name="{s}_{j}" joint="{s}_{j}" ctrlrange="-1 1" gear="60"/>'
                 for s in ("left", "right") for j in ("hip", "ankle"))  # fmt: skip


def faults(tmp_path: Path, text: str, table: Described | None = None) -> str:
    table = table or Described()
    path = tmp_path / "r.xml"
    path.write_text(text, encoding="utf-8")
    os.utime(path, ns=(id(text), hash((text, table)) % 10**15))  # looked at anew
    return "; ".join(looked_at(path, table).faults)


def test_a_robot_is_recognised_with_its_feet_right_first(tmp_path):
    path = tmp_path / "r.xml"
    path.write_text(model(actuators=MOTORS), encoding="utf-8")
    robot = robot_of(path, Described())
    assert (robot.base, robot.planar, robot.legs) == ("trunk", False, ("right_foot", "left_foot"))
    assert [len(foot.points) for foot in robot.feet] == [4, 4]
    np.testing.assert_allclose(sorted(robot.feet[0].points)[0], (-0.08, -0.04, -0.04), atol=1e-12)
    assert [drive.limit for drive in robot.drives] == [60.0] * 4
    assert robot.leg == pytest.approx(0.45 + 0.04)
    assert robot.mass == pytest.approx(sum(mujoco.MjModel.from_xml_path(str(path)).body_mass))


def test_the_planar_robots_are_what_their_descriptions_say():
    for name in ("human", "robot"):
        robot, tree = robot_of(MODELS / f"{name}.xml", Described()), tree_at(MODELS / f"{name}.xml")
        assert robot.planar
        assert robot.leg == pytest.approx(tree.leg, abs=2e-6)
        assert robot.mass == pytest.approx(float(tree.mass.sum()))
        np.testing.assert_allclose([point[0] for foot in robot.feet for point in foot.points], tree.point[:, 0])


def test_gymnasiums_masses_are_met():
    """Of its own files, as of gymnasium 1.2: 23.677 kg."""
    assert robot_of(MODELS / "walker2d.xml", Described()).mass == pytest.approx(23.677136632555076, rel=1e-9)
    assert [drive.limit for drive in robot_of(MODELS / "walker2d.xml", Described()).drives] == [100.0] * 6


def test_gymnasiums_own_files():
    """With the package at hand."""
    root = Path(pytest.importorskip("gymnasium").__file__).parent / "envs" / "mujoco" / "assets"
    walker = robot_of(root / "walker2d_v5.xml", Described())
    assert walker.planar
    assert walker.legs == ("foot", "foot_left")
    assert len(robot_of(root / "humanoid.xml", Described()).drives) == 17


def test_every_fault_at_once_with_what_to_write(tmp_path):
    table = Described(foot=(Foot(geoms=("sole",)), Foot(bodies=("left_foot",))), start="stand",
                      actuators=Actuators(names=("left_hip", "hip")))  # fmt: skip
    muscle = '<muscle name="left_hip" joint="left_hip" lengthrange="0.1 1"/>'
    told = faults(tmp_path, model(actuators=muscle), table)
    for words in ("no keyframe 'stand'", "'hip' is no actuator of the file; did you mean 'left_hip'?", "<motor>",
                  "foot[0].geoms: no geom 'sole'; did you mean 'left_sole'?"):  # fmt: skip
        assert words in told


@pytest.mark.parametrize(
    ("text", "table", "words"),
    [
        (model(base="", actuators=MOTORS), Described(), "write <freejoint/> in body 'trunk'"),
        (model(actuators=MOTORS), Described(base=Base(body="torso")), "no body 'torso'; valid: trunk"),
        (model(), Described(), "<actuator><motor joint="),
        (model(actuators='<position name="p" joint="left_hip" kp="0"/>'), Described(), "neither torque, position nor"),
        (model(actuators=MOTORS + MOTORS.replace('name="', 'name="other_')), Described(), "has several"),
        (
            model(actuators=MOTORS, world='<geom type="plane" size="1 1 1" pos="0 0 1"/>'),
            Described(),
            "level plane z = 0",
        ),
        (model(actuators=MOTORS), Described(foot=(Foot(bodies=("left_foot",)),)), "two tables [[robot.foot]], got 1"),
        (
            model(actuators=MOTORS),
            Described(foot=(Foot(name="a", bodies=("left_foot",)), Foot(name="b", bodies=("left_foot",)))),
            "is part of the first foot too; expected each geom in one foot",
        ),
        (
            model(actuators=MOTORS),
            Described(foot=(Foot(name="a", bodies=("left_foot",)), Foot(name="a", bodies=("right_foot",)))),
            "robot.foot[1].name: expected another name than that of the first foot, 'a'",
        ),
    ],
)
def test_faults(tmp_path, text, table, words):
    assert words in faults(tmp_path, text, table)


MOON = '<option gravity="0 0 -1.62"/><worldbody>'


def test_files_as_they_are_found(tmp_path, monkeypatch):
    """A scene with a relative include, lost looks, an idle joint, two grounds and a keyframe without a name."""
    monkeypatch.chdir(tmp_path)
    inertia = '<inertial mass="3" pos="0 0 0" diaginertia="1 1 1"/>'
    idle = f'<body name="spare" pos="0 0 9">{inertia}<joint name="none"/></body>'
    look = inertia + '<geom type="mesh" mesh="lost" contype="0" conaffinity="0"/>'
    keys = '<key qpos="1 0 0 0.6 1 0 0 0 0 0 0 0"/>'
    text = model(actuators=MOTORS + '<motor joint="none"/>', world=idle, keys=keys)
    text = text.replace("<worldbody>", '<asset><mesh name="lost" file="lost.stl"/></asset><worldbody>')
    text = text.replace("<freejoint/>", f"<freejoint/>{look}")
    write("r.xml", text)
    plane = '<geom name="{}" type="plane" size="1 1 1"/>'
    write("scene.xml", '<mujoco><include file="r.xml"/><worldbody>' + plane.format("a")
          + f'<body name="fixed">{plane.format("b")}</body></worldbody></mujoco>')  # fmt: skip
    robot, wrong, notes = looked_at(Path("scene.xml"), Described())
    assert not wrong
    assert robot is not None
    assert robot.start == "key_0"
    assert [drive.joint for drive in robot.drives] == ["left_hip", "left_ankle", "right_hip", "right_ankle"]
    assert len(robot.q_names) == 7 + 4
    for words, note in zip(("(lost.stl", "'spare'", "'a'; level planes of the same height touch nothing: 'b'"), notes,
                           strict=True):  # fmt: skip
        assert words in note
    write("s.toml", 'model = "scene.xml"\nlaw = "stand"\nrobot = {}\n')
    own = compiled(Path("scene.xml"), read_scenario("s.toml"), "torque")
    meets = [own.geom(name).contype[0] for name in ("a", "b")]
    assert (meets[0] > 0, meets[1]) == (True, 0)
    trunk = [g for g in drawn_geoms(own) if own.geom_bodyid[g] == own.body("trunk").id]
    legs = [own.geom_type[g] == mujoco.mjtGeom.mjGEOM_CAPSULE and not own.geom_contype[g] for g in trunk]
    assert sum(legs) == 2, "capsules to both legs in the place of the lost mesh"
    write("plain.xml", text.replace('<geom type="mesh" mesh="lost" contype="0" conaffinity="0"/>', ""))
    write("plain.toml", 'model = "plain.xml"\nlaw = "stand"\nrobot = {}\n')
    plain = compiled(Path("plain.xml"), read_scenario("plain.toml"), "torque")
    robot = slice(1, 6)  # the scene has a body more, of its ground
    np.testing.assert_array_equal(plain.body_mass[robot], own.body_mass[robot])
    np.testing.assert_array_equal(plain.body_inertia[robot], own.body_inertia[robot])
    write("r.xml", text.replace('mesh="lost" contype="0"', 'mesh="lost" contype="1"'))
    os.utime("scene.xml", ns=(1, 1))  # looked at anew
    with pytest.raises(InputError, match=r"mesh 'lost.stl': there is no such file, and body 'trunk' touches things"):
        looked_at(Path("scene.xml"), Described())


def test_assets_above_the_folder_are_for_those_who_trust_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mjcf").mkdir()
    Path("meshes").mkdir()
    corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    write("meshes/m.obj", "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "f 1 2 3\nf 1 3 5\nf 1 5 2\nf 2 3 5\n")
    text = model(actuators=MOTORS).replace(
        "<worldbody>", '<compiler meshdir="../meshes"/><asset><mesh name="m" file="m.obj"/></asset><worldbody>', 1
    )
    write("mjcf/r.xml", text)
    with pytest.raises(InputError, match="give --trust"):
        looked_at(Path("mjcf/r.xml"), Described())
    with trusting(everything=True):
        assert looked_at(Path("mjcf/r.xml"), Described()).robot is not None


OPTION = '<option timestep="0.005" integrator="implicitfast" iterations="3" ls_iterations="5"/>'


def test_physics_is_the_files_where_a_scenario_asks_for_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    floor = '<geom name="floor" type="plane" size="1 1 1" friction="0.6" solref="0.03 1.2"/>'
    write("r.xml", model(actuators=MOTORS, world=floor).replace("<mujoco>", "<mujoco>" + OPTION))
    write("s.toml", 'model = "r.xml"\nlaw = "stand"\nrobot = {}\n')
    ours = compiled(Path("r.xml"), read_scenario("s.toml"), "torque")
    assert (ours.opt.timestep, ours.opt.iterations, ours.opt.ls_iterations) == (0.001, 100, 50)
    assert main(["model", "r.xml"]) == 0
    assert "the file asks for timestep 0.005 s, integrator implicitfast, cone pyramidal" in " ".join(
        capsys.readouterr().out.split()
    )
    s = read_scenario("s.toml", ["simulation.physics=file"])
    assert s.simulation.control_rate == 200.0
    theirs, plain = compiled(Path("r.xml"), s, "torque"), mujoco.MjModel.from_xml_path("r.xml")
    for name in ("timestep", "integrator", "cone", "impratio", "tolerance", "iterations", "ls_iterations", "solver"):
        assert getattr(theirs.opt, name) == getattr(plain.opt, name), name
    for name in ("geom_friction", "geom_solref", "geom_priority", "geom_condim"):
        np.testing.assert_array_equal(getattr(theirs, name), getattr(plain, name))
    s = read_scenario("s.toml", ["simulation.physics=file", "simulation.timestep=0.001", "ground.friction=0.3"])
    mixed = compiled(Path("r.xml"), s, "torque")
    assert (mixed.opt.timestep, mixed.geom("floor").friction[0], mixed.geom("floor").solref[0]) == (0.001, 0.3, 0.03)
    assert mixed.geom("floor").priority > 0


FLAG = '<option><flag {}="disable"/></option><worldbody>'
BOX = '<geom name="box" type="box" size="1 1 0.1"/>'
BALL = '<body name="ball" pos="2 0 1">{}<geom name="of_ball" size="0.1" mass="7" contype="{}" conaffinity="0"/></body>'
RANGE = 'ctrlrange="-1 1"'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (model(actuators=MOTORS).replace("<worldbody>", MOON), "expected 0 0 -9.81"),
        (model(actuators=MOTORS).replace("<worldbody>", FLAG.format("contact")), "contact disabled"),
        (model(actuators=MOTORS).replace("<worldbody>", FLAG.format("actuation")), "actuation disabled"),
        (model(actuators=MOTORS).replace('name="trunk"', 'name="trunk" gravcomp="1"'), "'trunk': gravcomp 1"),
        (model(actuators=MOTORS, world=BOX), "geom 'box' of 'world': the robot can touch it"),
        (model(actuators=MOTORS, world=BALL.format("", 1)), "geom 'of_ball' of 'ball': the robot can touch it"),
        (model(actuators=MOTORS.replace(RANGE, 'ctrlrange="0 1"')), "ctrlrange 0 1: expected as much one way as"),
        (model(actuators=MOTORS.replace(RANGE, 'forcerange="-2 1"')), "forcerange -2 1: expected as much"),
        (model(actuators=MOTORS.replace(RANGE, 'delay="0.01" nsample="10"')), "has a delay of its own"),
    ],
)  # fmt: skip
def test_what_a_file_asks_for_that_no_run_does(tmp_path, text, words):
    assert words in faults(tmp_path, text)


def test_what_moves_beside_the_robot_is_a_fault_and_what_stands_there_is_no_part_of_it(tmp_path):
    table = Described(base=Base(body="trunk"))
    assert "body 'ball': moves" in faults(
        tmp_path, model(actuators=MOTORS, world=BALL.format("<freejoint/>", 0)), table
    )
    path = tmp_path / "s.xml"
    path.write_text(model(actuators=MOTORS, world=BALL.format("", 0)), encoding="utf-8")
    alone = tmp_path / "alone.xml"
    alone.write_text(model(actuators=MOTORS), encoding="utf-8")
    assert robot_of(path, table).mass == robot_of(alone, table).mass
    assert robot_of(path, table).top == robot_of(alone, table).top


def test_a_ground_that_is_added_can_be_touched_whatever_the_files_default(tmp_path):
    default = '<default><geom contype="0" conaffinity="0"/></default><worldbody>'
    text = model(actuators=MOTORS).replace("<worldbody>", default)
    text = text.replace('size="0.1 0.04 0.02"', 'size="0.1 0.04 0.02" contype="1" conaffinity="1"')
    assert faults(tmp_path, text) == ""


def test_actuators_without_a_name_get_one_each(tmp_path):
    motors = '<motor joint="left_hip"/><motor joint="left_hip"/>'
    assert "joint 'left_hip' has several" in faults(tmp_path, model(actuators=motors))


def test_kinds_and_limits_of_actuators(tmp_path):
    path = tmp_path / "k.xml"
    path.write_text(model(actuators="""
        <position name="a" joint="left_hip" kp="100" kv="5" gear="2" forcerange="-10 10"/>
        <velocity name="b" joint="right_hip" kv="7"/>
        <motor name="c" joint="left_ankle"/>"""), encoding="utf-8")  # fmt: skip
    a, b, c = robot_of(path, Described()).drives
    assert (a.kind, a.stiffness, a.damping, a.limit) == ("position", 400.0, 20.0, 20.0)
    assert (b.kind, b.damping) == ("velocity", 7.0)
    assert (c.kind, c.limited) == ("torque", False)


def test_a_urdf_gets_a_free_base_a_ground_and_motors(tmp_path):
    joint = """<joint name="{s}" type="revolute"><parent link="base"/><child link="{s}_foot"/><origin xyz="0 {y} -0.1"/>
      <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="50" velocity="3"/></joint>
      <link name="{s}_foot"><inertial><mass value="1"/><origin xyz="0 0 -0.3"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><origin xyz="0 0 -0.5"/><geometry><box size="0.2 0.1 0.05"/></geometry></collision></link>"""
    path = tmp_path / "r.urdf"
    legs = joint.format(s="left", y=0.1) + joint.format(s="right", y=-0.1)
    path.write_text(f"""<robot name="r"><link name="base"><inertial><mass value="10"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>{legs}</robot>""",
                    encoding="utf-8")  # fmt: skip
    robot = robot_of(path, Described())
    assert (robot.base, robot.planar, robot.mass) == ("base", False, 12.0)
    assert [(drive.joint, drive.limit) for drive in robot.drives] == [("left", 50.0), ("right", 50.0)]
    assert [len(foot.points) for foot in robot.feet] == [4, 4]


INERTIAL = """<inertial><mass value="{}"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>"""
FIXED = """<joint name="{a}_{b}" type="fixed"><parent link="{a}"/><child link="{b}"/><origin xyz="0 0 {z}"/></joint>"""


def urdf(shape: str = '<box size="0.2 0.1 0.05"/>', before: str = "", after: str = "") -> str:
    """A URDF of two legs, each of a hip and a knee."""
    joint = """<joint name="{s}_{j}" type="revolute"><parent link="{of}"/><child link="{s}_{to}"/>
      <origin xyz="0 {y} -0.3"/><axis xyz="0 1 0"/>
      <limit lower="-1" upper="1" effort="50" velocity="3"/>{more}</joint>"""
    legs = "".join(
        f"""{joint.format(s=s, j="hip", of="base", to="thigh", y=y, more="")}
        <link name="{s}_thigh">{INERTIAL.format(1)}</link>
        {joint.format(s=s, j="knee", of=f"{s}_thigh", to="foot", y=0, more=after)}<link name="{s}_foot">
        {INERTIAL.format(1)}<collision><origin xyz="0 0 -0.3"/><geometry>{shape}</geometry></collision></link>"""
        for s, y in (("left", 0.1), ("right", -0.1))
    )
    return f"""<robot name="r">{before}<link name="base">{INERTIAL.format(10)}</link>{legs}</robot>"""


def test_frames_of_a_urdf_weigh_nothing_and_a_root_without_mass_is_no_trunk(tmp_path):
    root = '<link name="footprint"/>' + FIXED.format(a="footprint", b="base", z=0.8)
    camera = '<link name="camera"/>' + FIXED.format(a="base", b="camera", z=0.3)
    path = tmp_path / "r.urdf"
    path.write_text(urdf(before=root + camera), encoding="utf-8")
    robot = robot_of(path, Described())
    assert (robot.base, robot.trunk, robot.mass) == ("footprint", "base", 14.0)
    assert robot.bodies[robot.trunk_number - 1] == "base"


def test_a_link_that_moves_needs_a_mass(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(urdf().replace(INERTIAL.format(1), "", 1), encoding="utf-8")
    with pytest.raises(InputError, match="left_thigh"):
        robot_of(path, Described())


def test_a_joint_that_follows_another_has_no_motor(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(urdf(after='<mimic joint="left_hip" multiplier="-1"/>'), encoding="utf-8")
    assert [drive.joint for drive in robot_of(path, Described()).drives] == ["left_hip", "right_hip"]


@pytest.mark.parametrize("place", ["my_robot/meshes/foot.obj", "meshes/foot.obj", "foot.obj"])
def test_meshes_of_a_ros_package(tmp_path, place):
    path = tmp_path / "r.urdf"
    path.write_text(urdf('<mesh filename="package://my_robot/meshes/foot.obj"/>'), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape("my_robot/meshes/foot.obj, meshes/foot.obj, foot.obj")):
        robot_of(path, Described())
    (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
    corners = [f"v {x} {y} {z}" for x in (-0.1, 0.1) for y in (-0.04, 0.04) for z in (-0.02, 0.02)]
    faces = ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
    (tmp_path / place).write_text("\n".join(corners + faces), encoding="utf-8")
    assert [len(foot.points) for foot in robot_of(path, Described()).feet] == [4, 4]


def test_gravity_of_a_slope_in_two_directions():
    np.testing.assert_allclose(gravity3(4.0, 0.0)[[0, 2]], gravity(4.0), atol=1e-12)
    g, turn = gravity3(5.0, -3.0), frame(5.0, -3.0)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.norm(g) == pytest.approx(9.81)
    assert g[1] > 0.0  # falling to the left
    np.testing.assert_allclose(turn[2] / turn[2, 2], [-np.tan(np.radians(5.0)), -np.tan(np.radians(-3.0)), 1.0])


def test_what_a_law_senses_is_pinocchios(tmp_path, monkeypatch):
    """M, h and the contact points' Jacobian in space, by another library from the same file."""
    monkeypatch.chdir(tmp_path)
    inertial = '<inertial pos="0.01 0.02 -0.1" mass="2" diaginertia="0.03 0.04 0.02"/>'
    path = Path(write("r.xml", re.sub(r"(<body [^>]*>)", rf"\1{inertial}", model(actuators=MOTORS))))
    s = read_scenario(write("s.toml", 'model = "r.xml"\nlaw = "stand"\n'))
    robot, mj = robot_of(path, s.robot), compiled(path, s, "torque")
    data, rng = mujoco.MjData(mj), np.random.default_rng(0)
    mujoco.mj_integratePos(mj, data.qpos, 0.3 * rng.standard_normal(mj.nv), 1.0)
    data.qvel[:] = rng.standard_normal(mj.nv)
    mujoco.mj_step1(mj, data)
    sensed = Observation(mj, data, robot)
    other = pinocchio.buildModelFromMJCF(str(path))
    there = other.createData()
    # Pinocchio's free joint has its linear velocity in the base's frame and the quaternion's w last.
    turn = np.eye(mj.nv)
    turn[:3, :3] = sensed.base.orientation
    q, v = data.qpos.copy(), turn.T @ data.qvel
    q[3:7] = np.roll(data.qpos[3:7], -1)
    order = [other.joints[other.getJointId(mj.joint(j).name)].idx_v for j in range(1, mj.njnt)]
    place = np.concatenate([np.arange(6), order])
    q2, v2 = q.copy(), v.copy()
    q2[np.array(order) + 1], v2[order] = q[7:], v[6:]
    M = pinocchio.crba(other, there, q2, pinocchio.Convention.WORLD)
    M = (np.triu(M) + np.triu(M, 1).T)[np.ix_(place, place)]
    np.testing.assert_allclose(turn @ M @ turn.T, sensed.M, atol=1e-9)
    # h with the velocity of the base in the world's frame: M v̇ + h is the same, v̇ differs by w x v.
    h = pinocchio.nonLinearEffects(other, there, q2, v2)[place]
    bias = np.zeros(mj.nv)
    bias[:3] = np.cross(data.qvel[3:6], sensed.base.orientation.T @ data.qvel[:3])
    np.testing.assert_allclose(turn @ (h - M @ bias), sensed.h, atol=1e-8)
    assert sensed.J.shape == (24, mj.nv)
    step, before, bias = 1e-7, sensed.points.copy(), sensed.b.copy()
    velocity, speed = sensed.point_velocity.copy(), data.qvel.copy()
    mujoco.mj_integratePos(mj, data.qpos, speed, step)
    mujoco.mj_kinematics(mj, data)
    sensed.begin(0.0)
    np.testing.assert_allclose((sensed.points - before) / step, velocity, atol=1e-5)
    mujoco.mj_comPos(mj, data)
    np.testing.assert_allclose((velocity.ravel() - sensed.J @ speed) / step, bias, atol=1e-4)


def test_the_command(capsys, tmp_path, monkeypatch):
    assert main(["model", "h1"]) == 0
    told = capsys.readouterr().out
    for words in ("pelvis, moves in space", "4 contact points", "51.44 kg", "300 N m", "law = 'stand'"):
        assert words in told
    told = " ".join(told.split())
    for part in ("torso pelvis; a straight leg is 0.87 m long", "right_thigh; right_hip_yaw", "left_ankle turns it"):
        assert part in told
    assert main(["model", "humanoid"]) == 0
    told = capsys.readouterr().out
    assert "laws law = 'stand'," in " ".join(told.split())
    assert "not law = 'thesis': foot 'right_shin' hangs on 4 joints" in " ".join(told.split())
    assert main(["model", "human3d"]) == 0
    assert "law = 'thesis', law = 'stand'" in capsys.readouterr().out
    assert main(["model", "human"]) == 0
    assert "planar biped of seven links" in capsys.readouterr().out
    monkeypatch.chdir(tmp_path)
    assert main(["model", write("r.xml", model(base=""))]) == 1
    told = capsys.readouterr().out
    assert told.count("fault") == 2
    code, found = command(capsys, "model", "humanoid")
    assert code == 0
    assert found["robot"]["planar"] is False
    assert not found["seven_links"]


def test_a_planar_model_says_all_that_it_lacks(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = write("r.xml", model(actuators=MOTORS))
    with pytest.raises(
        InputError, match=r"body 'torso': missing.*missing too: body 'right_thigh'.*law = 'thesis'.*'path.py:Class'"
    ):
        tree_at(Path(path))
