"""Parts of a model file that hold or drive a robot from outside are named, of any robot and of seven links."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from biped.base.errors import InputError
from biped.cli.main import main
from biped.robot.holding import free_bases
from biped.robot.planar.model import check_home, checked_model
from biped.robot.recognise import looked_at
from biped.robot.spec import parsed
from biped.scenario.robot import Described
from tests.cases import write

WALKER, HUMAN = (Path("models", name).read_text(encoding="utf-8") for name in ("walker2d.xml", "human.xml"))
PITCH = '<joint name="root_pitch" class="root" axis="0 1 0" limited="false"/>'
MOTOR = '<motor name="{0}" joint="{0}"'
SITE = '<site name="{}" pos="0 0 {}"/>'


def of_pitch(what: str) -> str:
    assert PITCH in WALKER
    return WALKER.replace(PITCH, f'<joint name="root_pitch" axis="0 1 0" {what}/>')


def beside(text: str, parts: str, world: str = "") -> str:
    """A model file with more sections, and more in its world."""
    return text.replace("<worldbody>", f"<worldbody>{world}").replace("</mujoco>", f"{parts}</mujoco>")


def fixed(joint: str, key: str = "stiffness") -> str:
    return f'<tendon><fixed name="rope" {key}="5000"><joint joint="{joint}" coef="1"/></fixed></tendon>'


HOOK = SITE.format("hook", 3)
ROPE = '<tendon><spatial name="rope" stiffness="500"><site site="hook"/><site site="top"/></spatial></tendon>'
ROPE_ON = WALKER.replace('<geom name="torso"', SITE.format("top", 0.2) + '<geom name="torso"')
STILL = '<body name="pole" pos="0 3 0"><geom type="sphere" size="0.1" contype="0" conaffinity="0"/></body>'

ANY = [
    (of_pitch('class="root" limited="true" range="-2 2"'), "joint 'root_pitch' of the base: range: expected none"),
    (of_pitch('class="root" limited="false" stiffness="5"'), "'root_pitch' of the base: stiffness 5"),
    (of_pitch('limited="false" armature="0" damping="2"'), "'root_pitch' of the base: damping 2"),
    (of_pitch('class="root" limited="false" frictionloss="2"'), "'root_pitch' of the base: frictionloss 2"),
    (of_pitch('limited="false" damping="0" armature="7"'), "'root_pitch' of the base: armature 7"),
    (of_pitch('limited="false" armature="0" damping="0 1"'), "damping or stiffness that is not linear"),
    (WALKER.replace("</actuator>", '<motor name="engine" joint="root_x" gear="500"/></actuator>'),
     "actuator 'engine': drives the base by its joint 'root_x'"),
    (ROPE_ON.replace("</actuator>", '<general name="jet" site="top" gear="0 0 1 0 0 0"/></actuator>'),
     "actuator 'jet': pushes a site against nothing"),
    (WALKER.replace("</actuator>", '<adhesion name="glue" body="left_foot" ctrlrange="0 1"/></actuator>'),
     "actuator 'glue': sticks to what it touches"),
    (beside(WALKER, '<equality><weld name="nail" body1="torso"/></equality>'),
     "equality 'nail': 'torso' is welded to the world"),
    (beside(WALKER, '<equality><connect name="pin" body1="torso" body2="pole" anchor="0 0 0"/></equality>', STILL),
     "equality 'pin': 'torso' is connected to the world"),
    (beside(WALKER, '<equality><connect body1="left_shank" anchor="0 0 0"/></equality>'),
     "'left_shank' is connected to the world"),
    (beside(WALKER, '<equality><joint name="rail" joint1="root_pitch"/></equality>'),
     "equality 'rail': holds the joint 'root_pitch' of the base"),
    (beside(WALKER, '<equality><joint joint1="left_hip" joint2="root_pitch"/></equality>'),
     "holds the joint 'root_pitch' of the base"),
    (beside(WALKER, fixed("root_pitch")), "tendon 'rope': goes over the joint 'root_pitch' of the base"),
    (beside(WALKER, fixed("root_z", "damping")), "tendon 'rope': goes over the joint 'root_z' of the base"),
    (beside(ROPE_ON, ROPE, HOOK), "tendon 'rope': is fastened to the world"),
    (beside(ROPE_ON, ROPE, STILL.replace("<geom", HOOK + "<geom")), "tendon 'rope': is fastened to the world"),
    (WALKER.replace('integrator="Euler"', 'integrator="Euler" wind="3 0 0"'), "option: wind 3 0 0: expected none"),
    (WALKER.replace('integrator="Euler"', 'integrator="Euler" density="1000"'), "option: density 1000: expected 0"),
    (WALKER.replace('integrator="Euler"', 'integrator="Euler" viscosity="2"'), "option: viscosity 2: expected 0"),
    (WALKER.replace('<body name="torso"', '<body name="torso" gravcomp="0.5"'), "body 'torso': gravcomp 0.5"),
    (beside(WALKER, '<option><flag gravity="disable"/></option>'), "flag: gravity disabled"),
]  # fmt: skip

SEVEN = [
    (HUMAN.replace('<joint name="root_pitch"/>', '<joint name="root_pitch" damping="1e4"/>'),
     "'root_pitch' of the base: damping 10000"),
    (HUMAN.replace('<joint name="root_pitch"/>', '<joint name="root_pitch" stiffness="1e4"/>'),
     "'root_pitch' of the base: stiffness 10000"),
    (beside(HUMAN, fixed("root_pitch")), "tendon 'rope': goes over the joint 'root_pitch' of the base"),
    (beside(HUMAN, '<equality><weld name="nail" body1="torso"/></equality>'), "'torso' is welded to the world"),
    (HUMAN.replace('<body name="torso"', '<body name="torso" gravcomp="1"'), "body 'torso': gravcomp 1"),
    (HUMAN.replace('midphase="disable"', 'midphase="disable" gravity="disable"'), "flag: gravity disabled"),
    (HUMAN.replace('integrator="Euler"', 'integrator="Euler" wind="0 0 3" density="1"'), "option: wind 0 0 3"),
]  # fmt: skip


def fault(path: Path) -> str:
    return "; ".join(looked_at(path, Described()).faults)


@pytest.mark.parametrize(("text", "words"), ANY, ids=[words for _, words in ANY])
def test_what_holds_a_robot_of_any_kind_is_named(tmp_path, text, words):
    assert text != WALKER, "the case changes the file"
    path = tmp_path / "held.xml"
    path.write_text(text, encoding="utf-8")
    assert words in fault(path)


@pytest.mark.parametrize(("text", "words"), SEVEN, ids=[words for _, words in SEVEN])
def test_what_holds_seven_links_is_named(tmp_path, text, words):
    assert text != HUMAN, "the case changes the file"
    path = tmp_path / "held.xml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        checked_model(path)
    assert words in fault(path), "and as any robot"


def test_parts_inside_a_robot_are_its_own(tmp_path):
    """Springs, friction, ropes and loops between its own parts hold nobody up."""
    path = tmp_path / "own.xml"
    loop = '<equality><joint joint1="left_hip" joint2="right_hip" polycoef="0 -1 0 0 0"/></equality>'
    text = beside(WALKER, fixed("left_knee") + loop)
    path.write_text(text.replace('<joint name="left_hip"', '<joint name="left_hip" stiffness="3" frictionloss="1"'),
                    encoding="utf-8")  # fmt: skip
    assert fault(path) == ""


def test_what_defaults_put_on_a_free_base_is_left_out_with_a_word(tmp_path):
    """As files that are found have it: a default of all joints holds the base too."""
    robot = Path("models/h1.xml").read_text(encoding="utf-8")
    free = "<freejoint" if "<freejoint" in robot else None
    held = '<joint type="free" damping="1" frictionloss="0.2" armature="0.1" stiffness="3"'
    path = tmp_path / "found.xml"
    path.write_text(robot.replace(free or '<joint type="free"', held), encoding="utf-8")
    found = looked_at(path, Described())
    assert found.faults == ()
    assert any("of the base: damping 1, frictionloss 0.2, armature 0.1, stiffness 3 left out" in note
               for note in found.notes)  # fmt: skip
    model = parsed(path, Described())[1]
    assert not model.dof_damping[:6].any()
    assert not model.dof_armature[:6].any()
    assert not model.dof_frictionloss[:6].any()
    assert not model.jnt_stiffness[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HUMAN.replace('<joint name="right_hip"', '<joint stiffness="50" name="right_hip"'), "'right_hip': stiffness"),
        (HUMAN.replace('<joint name="right_hip"', '<joint frictionloss="5" name="right_hip"'), "'right_hip': friction"),
        (HUMAN.replace('<joint name="right_hip"', '<joint damping="0 1" name="right_hip"'), "that is not linear"),
        (beside(HUMAN, fixed("right_hip")), "tendon 'rope'"),
        (beside(HUMAN, '<equality><joint name="tie" joint1="left_hip" joint2="right_hip"/></equality>'),
         "equality 'tie'"),
    ],
)  # fmt: skip
def test_home_refuses_what_it_would_leave_out(tmp_path, capsys, text, words):
    path = Path(write(str(tmp_path / "sprung.xml"), text))
    checked_model(path)
    with pytest.raises(InputError, match=words):
        check_home(path)
    scenario = write(
        str(tmp_path / "s.toml"), f'model = "{path}"\ncontroller = "normal"\nengine = "home"\nduration = 1.0\n'
    )
    assert main(["run", scenario]) == 2
    error = " ".join(capsys.readouterr().err.split())
    assert "engine: home has no equations for parts" in error
    assert words in error


def test_the_command_names_every_part(tmp_path, capsys):
    text = beside(of_pitch('class="root" limited="true" range="-2 2"'), fixed("root_z"))
    assert main(["model", write(str(tmp_path / "held.xml"), text)]) == 1
    flat = " ".join(capsys.readouterr().out.split())
    assert "joint 'root_pitch' of the base: range" in flat
    assert "tendon 'rope': goes over the joint 'root_z' of the base" in flat


THREE_SLIDES = """
<mujoco>
  <worldbody>
    <body name="trunk" pos="0 0.3 0.8" {turned}>
      <joint type="slide" axis="1 0 0" limited="false"/>
      <joint type="slide" axis="0 1 0" {end}/>
      <joint name="up" type="slide" axis="0 0 1"/>
      <joint type="ball" limited="false"/>
      <geom size="0.1" pos="0.1 0 0"/>
      <body pos="0.1 0 0">
        <joint axis="0 1 0"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 0.1 0.1 0.3"/>
      </body>
    </body>
  </worldbody>
  <sensor>{sensor}</sensor>
  <keyframe><key qpos="0 0 0.1 1 0 0 0 0.3"/></keyframe>
</mujoco>
"""


def states_after(model: mujoco.MjModel) -> np.ndarray:
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qvel[:] = np.random.default_rng(0).normal(size=model.nv)
    for _ in range(200):
        mujoco.mj_step(model, data)
    return np.concatenate([data.xpos.ravel(), data.qvel])


def test_three_slides_and_a_ball_are_a_free_joint():
    text = THREE_SLIDES.format(turned="", end="", sensor="")
    spec, notes = mujoco.MjSpec.from_string(text), list[str]()
    free_bases(spec, notes)
    model = spec.compile()
    assert "body 'trunk' are taken for a free joint" in notes[0]
    assert model.jnt_type.tolist() == [mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_HINGE]
    np.testing.assert_allclose(states_after(model), states_after(mujoco.MjModel.from_xml_string(text)), atol=1e-12)


@pytest.mark.parametrize(
    "other",
    [{"turned": 'euler="0 0 1"'}, {"end": 'range="-1 1"'}, {"end": 'ref="0.2"'}, {"sensor": '<jointpos joint="up"/>'}],
)
def test_what_is_no_free_joint_stays_as_it_is(other):
    text = THREE_SLIDES.format(**{"turned": "", "end": "", "sensor": ""} | other)
    spec, notes = mujoco.MjSpec.from_string(text), list[str]()
    free_bases(spec, notes)
    assert not notes
    assert spec.compile().njnt == 5
