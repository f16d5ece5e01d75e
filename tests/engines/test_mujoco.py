"""Robots of any kind in MuJoCo: against the planar path, conservation laws, commands, pushes, ends."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.base.trust import grant
from biped.engines.mujoco import simulate
from biped.engines.planar import mujoco as planar
from biped.ensemble import failures
from biped.ensemble.plan import Plan
from biped.measure.metrics import assess
from biped.measure.metrics import assess as assess_planar
from biped.measure.stored import load
from biped.robot.build import compiled
from biped.scenario.reading import read_scenario
from biped.studies.run import plan_of
from tests.cases import write

HERE = Path(tempfile.mkdtemp(prefix="biped-test-"))


def named(model: str, law: str = "stand") -> str:
    """A scenario of a robot that stands for a moment."""
    path = HERE / f"{model}.toml"
    if not path.is_file():
        path.write_text(f'model = "{model}"\nlaw = "{law}"\nduration = 0.4\n', encoding="utf-8")
    return str(path)


@lru_cache(maxsize=8)
def stood(model: str, *changes: str):
    """A short run of a standing robot."""
    return simulate(plan_of(named(model), changes).run(0))


def law_of(tmp_path: Path, body: str) -> str:
    path = tmp_path / "l.py"
    path.write_text(f"import numpy as np\n\n\nclass Law:\n{body}", encoding="utf-8")
    grant(path)
    return f"law={path}:Law"


def test_it_walks_the_human_as_the_compiled_path_does(tmp_path):
    """The thesis's law in Python on this path, compiled on the other: the same walk, tick by tick."""
    run = plan_of("any/walk", ("duration=0.6",)).run(0)
    file = tmp_path / "same.toml"  # the settings of the gait, which the law in Python has too, under no reading
    file.write_text('model = "human"\ncontroller = "normal"\nduration = 0.6\nwindow = {end = 0.6}', encoding="utf-8")
    other = plan_of(str(file), ())
    there = planar.simulate(replace(other.run(0), q=run.q, v=run.v))
    t = simulate(run)
    # The contact points lie a micrometre apart: that is their spheres' radius.
    np.testing.assert_allclose(t.q, there.q, atol=2e-5)
    np.testing.assert_allclose(t.force[:400, :, [0, 2]], there.column("force")[:400], atol=1.0)
    assert np.abs(t.u - there.u).max() < 0.05
    numbers, same = assess(t, (0.0, 0.6)).numbers, assess_planar(there, (0.0, 0.6)).numbers
    for name in ("distance", "speed", "cost_of_transport_absolute", "support", "double_support", "torso_lean"):
        assert numbers[name] == pytest.approx(same[name], rel=0.02, abs=0.02, nan_ok=True), name


def test_momentum_and_energy_are_accounted_for():
    push = "push=[{at=0.1,duration=0.1,force=[60.0,-40.0,20.0],body='torso'}]"
    t = stood("h1", push, "ground.slope=4", "ground.side_slope=-3")
    numbers = assess(t, (0.0, 0.4)).numbers
    assert numbers["energy_residual"] < 1e-3
    assert numbers["momentum_residual"] < 1e-3
    still = stood("h1", "ground.slope=4", "ground.side_slope=-3")
    pushed = t.robot.mass * (t.com_velocity - still.com_velocity) - 1e-3 * np.cumsum(
        np.vstack([np.zeros(3), (t.ground_force - still.ground_force)[:-1]]), axis=0
    )
    from biped.robot.ground import frame

    np.testing.assert_allclose(pushed[-1], frame(4.0, -3.0) @ [6.0, -4.0, 2.0], atol=2e-3)
    assert numbers["push_impulse"] == pytest.approx(np.linalg.norm([6.0, 4.0, 2.0]))


def test_the_ground_bears_the_weight_on_the_points_of_the_feet():
    t = stood("h1")
    weight = t.robot.mass * 9.81
    assert t.force[200:].sum(axis=1)[:, 2].mean() == pytest.approx(weight, rel=0.01)
    np.testing.assert_allclose(t.force.sum(axis=1), t.ground_force, atol=1e-9)
    pressure = (t.force[200:, :, 2, None] * t.point[200:, :, :2]).sum(axis=1) / t.force[200:, :, 2].sum(axis=1)[:, None]
    assert np.abs(pressure.mean(axis=0) - t.com[200:, :2].mean(axis=0)).max() < 0.02


def test_the_same_run_has_the_same_bytes_and_is_read_back(tmp_path):
    first, again = stood("walker2d"), simulate(plan_of(named("walker2d"), ()).run(0))
    assert first.log.tobytes() == again.log.tobytes()
    first.save(tmp_path / "t.npz")
    read = load(tmp_path / "t.npz")
    assert read.log.tobytes() == first.log.tobytes()
    assert read.about == first.about
    failures.save_packed(first.last(0.2), tmp_path / "t.xz")
    small = failures.load_packed(tmp_path / "t.xz")
    assert small.robot == first.robot
    for name in first.columns:
        np.testing.assert_allclose(small.column(name), first.last(0.2).column(name), atol=0.06)
    np.testing.assert_allclose(small.point, first.last(0.2).point, atol=1e-6)


def test_torques_are_clipped_and_counted(tmp_path):
    law = law_of(tmp_path, "    def __init__(self, setup):\n        self.limit = setup.torque_limit\n\n"
                 "    def torques(self, sensed):\n        return 3.0 * self.limit\n")  # fmt: skip
    t = simulate(plan_of(named("walker2d"), (law, "actuation.torque_limit=30", "duration=0.1")).run(0))
    assert np.abs(t.u).max() == pytest.approx(30.0)
    assert assess(t, (0.0, 0.1)).numbers["saturation"] == 1.0


@pytest.mark.parametrize("command", ["position", "velocity"])
def test_servos(tmp_path, command):
    """A robot of motors held by servos at its own rate: their torques are those of spring and damper."""
    law = law_of(tmp_path, f'    command = "{command}"\n\n    def __init__(self, setup):\n'
                 f"        self.held = setup.q[setup.robot.places] + 0.1 if '{command}' == 'position' else 0.5\n\n"
                 "    def torques(self, sensed):\n        return self.held * np.ones(6)\n")  # fmt: skip
    changes = (law, "duration=0.05", "robot.actuators={stiffness=200.0,damping=3.0}")
    t = simulate(plan_of(named("walker2d"), changes).run(0))
    q, v = t.q[:, t.robot.places], t.v[:, t.robot.columns]
    wanted = 200.0 * (q[0] + 0.1 - q) - 3.0 * v if command == "position" else 3.0 * (0.5 - v)
    np.testing.assert_allclose(t.u, wanted, atol=1e-9)


def test_servos_need_a_stiffness(tmp_path):
    law = law_of(tmp_path, '    command = "position"\n\n    def __init__(self, setup):\n        pass\n')
    with pytest.raises(InputError, match=r"'right_hip' is one of torque; write \[robot.actuators\] stiffness"):
        simulate(plan_of(named("walker2d"), (law,)).run(0))


def test_generalized_forces(tmp_path):
    """A force on every velocity: what lifts the base weighs nothing on the ground."""
    law = law_of(tmp_path, '    command = "generalized"\n\n    def __init__(self, setup):\n        pass\n\n'
                 "    def torques(self, sensed):\n        return np.array(sensed.h)\n")  # fmt: skip
    t = simulate(plan_of(named("walker2d"), (law, "duration=0.1")).run(0))
    assert t.ground_force[50:, 2].max() < 1.0
    assert np.abs(t.v).max() < 0.05


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("return np.zeros(5)", "expected 6 numbers, got shape \\(5,\\)"),
        ("return None", "got nothing"),
        ("return np.full(6, np.nan)", "finite"),
        ("return [{}] * 6", "expected 6 numbers"),
        ("return np.zeros(6) + 1j", "expected 6 numbers"),
        ("return ['1'] * 6", "expected 6 numbers"),
        ("return np.ma.masked_less(np.zeros(6), 1)", "expected 6 numbers"),
        ("return 1 / 0", r"ZeroDivisionError.*l.py, line 9"),
        ("sensed.q[0] = 1.0", "read-only"),
    ],
)
def test_laws_that_do_not(tmp_path, body, words):
    law = law_of(
        tmp_path, f"    def __init__(self, setup):\n        pass\n\n    def torques(self, sensed):\n        {body}\n"
    )
    with pytest.raises(InputError, match=words):
        simulate(plan_of(named("walker2d"), (law,)).run(0))


def test_a_law_that_fails_later_ends_its_run_and_logs_until_then(tmp_path):
    law = law_of(tmp_path, "    def __init__(self, setup):\n        self.signals = {'side': 0.0}\n\n"
                 "    def torques(self, sensed):\n        self.signals['side'] = sensed.com[1]\n"
                 "        return np.zeros(6) if sensed.time < 0.02 else None\n")  # fmt: skip
    t = simulate(plan_of(named("walker2d"), (law,)).run(0))
    assert (t.end, len(t)) == ("raised", 20)
    assert "returned no torques at 0.020 s" in t.cause
    assert np.isfinite(t.signals["side"][:20]).all()


def test_which_way_it_falls():
    push = "push=[{at=0.0,duration=0.2,force=[0.0,900.0,0.0],body='torso'}]"
    t = stood("h1", push, "duration=1.5")
    assert t.end == "fell"
    assert t.cause.startswith("fell to the left at ")
    assert np.degrees(np.arccos(t.turn[-1, 2, 2])) > 55.0


def test_keys_of_the_thesis_are_refused_by_name():
    with pytest.raises(
        InputError, match=r"actuation.mode: expected 'joint': law 'stand' .* nor of sensing.contact_height"
    ):
        read_scenario(named("h1"), ["sensing.contact_height=0.01", "actuation.mode=generalized"])
    with pytest.raises(InputError, match="engine: expected 'mujoco'"):
        read_scenario(named("h1"), ["engine=home"])
    for change, words in (
        ("push=[{at=0,duration=1,force=[0,0,0],body='head'}]", "no body 'head'"),
        ("start.posture=flat", "no keyframe 'flat'; valid: stand"),
    ):
        with pytest.raises(InputError, match=words):
            Plan(read_scenario(named("h1"), [change]))
    with pytest.raises(InputError, match=r"push\[0\].force: expected \[forward, left, up\] N"):
        Plan(read_scenario(named("h1"), ["push=[{at=0,duration=0.1,force=[1,0]}]"]))
    with pytest.raises(InputError, match=r"ground\.side_slope: expected 0"):
        Plan(read_scenario(named("walker2d"), ["ground.side_slope=2"]))


def test_a_model_without_the_humans_parts_is_general_with_a_law_of_ones_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("w.xml", Path(__file__).parents[2].joinpath("models", "humanoid.xml").read_text(encoding="utf-8"))
    write("l.py", "class Law:\n    pass\n")
    s = read_scenario(write("s.toml", 'model = "w.xml"\nlaw = "l.py:Law"\n'), looking=True)
    assert s.robot is not None
    assert s.ground.friction == 1.0
    write("s.toml", 'model = "human"\nlaw = "l.py:Law"\n')
    assert read_scenario("s.toml", looking=True).robot is None


def test_a_urdf_stands():
    """The shipped one, pushed as hard as its scenario ever does, on its steepest slopes."""
    push = "push=[{at=0.3,duration=0.2,force=[10.0,10.0,-10.0]}]"
    changes = ("duration=1.5", push, "randomise={}", "ground.slope=2", "ground.side_slope=-2")
    t = simulate(plan_of("any/urdf", changes).run(0))
    numbers = assess(t, (0.0, 1.5)).numbers
    assert t.end == "completed"
    assert numbers["stood"]
    assert len(t.robot.drives) == 10
    assert t.robot.mass == pytest.approx(16.0)
    assert [len(foot.points) for foot in t.robot.feet] == [4, 4]
    assert max(numbers["energy_residual"], numbers["momentum_residual"]) < 1e-2


LEG = """<body name="{s}_thigh" pos="0 {y} -0.05"><joint name="{s}_hip" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="2" contype="0" conaffinity="0"/>
<body name="{s}_shank" pos="0 0 -0.3"><joint name="{s}_knee" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="1" contype="0" conaffinity="0"/>
<body name="{s}_foot" pos="0 0 -0.3"><joint name="{s}_ankle" axis="0 1 0"/>
<geom type="box" pos="0.03 0 -0.03" size="0.1 0.05 0.02" mass="0.8"/></body></body></body>"""
DRIVEN = [f"{s}_{joint}" for s in ("left", "right") for joint in ("hip", "knee", "ankle")]
IDLE = """    def __init__(self, setup): pass

    def torques(self, sensed): return {}
"""
WOBBLES = """    def __init__(self, setup):
        self.robot, self.rest = setup.robot, setup.q[setup.robot.places]

    def torques(self, sensed):
        q, v = sensed.q[self.robot.places], sensed.v[self.robot.columns]
        return 100.0 * (self.rest + 0.3 * np.sin(12.0 * sensed.time + np.arange(len(q))) - q) - 2.0 * v
"""


def legged(
    name: str, described: str = "", joint: str = 'damping="0.5" armature="0.02"', motor: str = "", more: str = ""
):
    """A robot of two legs and a scenario of it that lasts for a moment; its path."""
    legs = LEG.format(s="left", y=0.1) + LEG.format(s="right", y=-0.1)
    motors = "".join(f'<motor name="of_{one}" joint="{one}" {motor}/>' for one in DRIVEN)
    (HERE / f"{name}.xml").write_text(f"""<mujoco><default><joint {joint}/></default><worldbody>
        <body name="trunk" pos="0 0 0.7"><freejoint/><geom type="box" size="0.08 0.12 0.2" pos="0 0 0.2" mass="15"
        contype="0" conaffinity="0"/>{legs}</body></worldbody><actuator>{motors}</actuator>{more}</mujoco>""",
                                      encoding="utf-8")  # fmt: skip
    path = HERE / f"{name}_scenario.toml"
    path.write_text(f'model = "{HERE / name}.xml"\nlaw = "stand"\nduration = 0.3\n{described}', encoding="utf-8")
    return str(path)


def test_torques_go_to_the_actuators_that_the_law_names_in_its_order():
    backward = f"[robot.actuators]\nnames = {[f'of_{one}' for one in reversed(DRIVEN)]!r}\n"
    pushed = "[[push]]\nat = 0.0\nduration = 0.1\nforce = [60.0, 0.0, 0.0]\n"
    one = simulate(plan_of(legged("forward", pushed), ()).run(0))
    other = simulate(plan_of(legged("backward", backward + pushed), ()).run(0))
    assert other.robot.actuators == tuple(reversed(one.robot.actuators))
    np.testing.assert_allclose(other.q, one.q, atol=1e-9)
    np.testing.assert_allclose(other.u[:, ::-1], one.u, atol=1e-6)
    assert np.abs(one.u).max() > 2.0


@pytest.mark.parametrize("named", [DRIVEN, DRIVEN[:-1]])
@pytest.mark.parametrize("command", ["torque", "generalized"])
def test_keyframes_and_sensors_of_actuators_stand_in_nobodys_way(tmp_path, named, command):
    more = """<keyframe><key name="k" qpos="0 0 0.7 1 0 0 0 0 0 0 0 0 0" ctrl="1 1 1 1 1 1"/></keyframe>
        <sensor><actuatorfrc actuator="of_right_ankle"/></sensor>"""
    described = f"[robot.actuators]\nnames = {[f'of_{one}' for one in named]!r}\n"
    size = len(named) if command == "torque" else 12
    law = law_of(tmp_path, f"    command = {command!r}\n\n    def __init__(self, setup): pass\n\n"
                           f"    def torques(self, sensed): return np.zeros({size})\n")  # fmt: skip
    t = simulate(plan_of(legged("kept", described, more=more), (law, "duration=0.02")).run(0))
    assert len(t) == 20


def test_a_motors_rotor_and_friction_stay_at_its_joint(tmp_path):
    """Geared three to one a rotor is felt ninefold; without the law's torques that is all that a motor does."""
    law = law_of(tmp_path, WOBBLES)
    at_joint = simulate(plan_of(legged("a", joint='damping="4.5" armature="0.9"'), (law,)).run(0))
    at_motor = simulate(plan_of(legged("b", joint="", motor='gear="3" damping="0.5" armature="0.1"'), (law,)).run(0))
    np.testing.assert_allclose(at_motor.q, at_joint.q, atol=1e-9)


@pytest.mark.parametrize(
    "kind",
    [
        {"joint": 'damping="0.5 1 2" armature="0.02"'},
        {"more": """<tendon><fixed damping="5" stiffness="20"><joint joint="left_knee" coef="1"/>
                    <joint joint="right_knee" coef="-1"/></fixed></tendon>"""},
    ],
)  # fmt: skip
def test_energy_that_other_dampers_take_is_accounted_for(tmp_path, kind):
    t = simulate(plan_of(legged("damped", **kind), (law_of(tmp_path, WOBBLES),)).run(0))
    assert t.end == "completed"
    assert assess(t, (0.0, 0.3)).numbers["energy_residual"] < 3e-3


def test_a_root_without_mass_falls_with_the_trunk_that_is_fixed_to_it(tmp_path):
    """Its own place may be on the ground."""
    text = Path(legged("rooted")).with_name("rooted.xml").read_text(encoding="utf-8")
    text = text.replace('<body name="trunk" pos="0 0 0.7"><freejoint/>',
                        '<body name="root"><freejoint/><body name="trunk" pos="0 0 0.7">')  # fmt: skip
    (HERE / "rooted.xml").write_text(text.replace("</worldbody>", "</body></worldbody>"), encoding="utf-8")
    law = law_of(tmp_path, IDLE.format("np.zeros(6)"))
    run = plan_of(str(HERE / "rooted_scenario.toml"), (law, "start.jitter=0.1", "duration=2")).run(0)
    t = simulate(run)
    assert (t.robot.base, t.robot.trunk) == ("root", "trunk")
    assert t.end == "fell"
    assert 0.1 < t.time[-1] < 1.5


def test_a_urdfs_robot_may_differ_from_its_file():
    """Its inertia is said with products, which MuJoCo takes either so or along its axes."""
    plan = plan_of("any/urdf", ("truth.part=[{name='trunk', mass=1.5, inertia=2.0}]", "truth.joint_damping=0.3"))
    plain = plan_of("any/urdf", ())
    true, file = (compiled(one.run(0).model, one.scenario, "torque") for one in (plan, plain))
    factor = np.where([file.body(i).name == "trunk" for i in range(file.nbody)], 3.0, 1.0)
    np.testing.assert_allclose(true.body_inertia, file.body_inertia * factor[:, None], rtol=1e-12)
    np.testing.assert_allclose(true.dof_damping[6:], file.dof_damping[6:] + 0.3)


def test_every_actuator_may_have_a_limit_of_its_own(tmp_path):
    law = law_of(tmp_path, IDLE.format("np.full(19, 1e3)"))
    limits = [0.5 * (1 + i) for i in range(19)]
    t = simulate(plan_of(named("h1"), (law, f"actuation.torque_limit={limits}", "duration=0.005")).run(0))
    np.testing.assert_allclose(t.u, np.tile(limits, (5, 1)))
    with pytest.raises(InputError, match="one for each of 19 actuators, got 6"):
        plan_of(named("h1"), ("actuation.torque_limit=[1, 1, 1, 1, 1, 1]",))
    with pytest.raises(InputError, match="one for each of 6 actuators, got 5"):
        plan_of("level_normal", ("actuation.torque_limit=[1, 1, 1, 1, 1]",))


def test_what_a_model_says_for_the_thesiss_law_stands_in_no_other_laws_way(tmp_path):
    """`human3d` asks for ground that only pushes; a law that stands has no such setting."""
    scenario = plan_of(named("human3d"), ()).scenario
    assert scenario.law == "stand"
    assert scenario.actuation.contacts == "released"  # what is nobody's
    assert (scenario.actuation.torque_limit, scenario.fall.height) == (150.0, 0.5)  # what is any law's stays
    law = law_of(tmp_path, IDLE.format("np.zeros(12)"))
    assert len(simulate(plan_of(named("human3d"), (law, "duration=0.005")).run(0))) == 5
    assert plan_of("spatial/own", ()).scenario.actuation.contacts == "pushing"
