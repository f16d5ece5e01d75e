"""Robots of any kind on ground that is not level: as on the level, as on a slope, and heights where they are."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from msgspec import structs

from biped.base.errors import InputError
from biped.engines.mujoco import simulate
from biped.ensemble import failures
from biped.measure.metrics import assess
from biped.measure.stored import load
from biped.robot.build import compiled
from biped.robot.ground import profile_of
from biped.robot.run import visual_model
from biped.scenario.world import Ground, Steps
from biped.studies.run import plan_of
from tests.engines.test_mujoco import law_of, named, stood

FAR = "ground.steps={rise=0.1,start=50.0}"
ANGLE = math.radians(12.0)
FOOT = 2.0
"""[m] where the ramp begins."""
BOXES = """
<mujoco>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="trunk" pos="0 0 0.6">
      <freejoint/>
      <geom type="box" size="0.05 0.1 0.1" mass="4"/>
      {legs}
    </body>
  </worldbody>
  <actuator><motor joint="r"/><motor joint="l"/></actuator>
</mujoco>
"""
LEG = """<body name="{name}_foot" pos="0 {y} -0.3">
  <joint name="{name}" axis="0 1 0" pos="0 0 0.2" damping="2" stiffness="40"/>
  <geom type="capsule" size="0.02" fromto="0 0 0 0 0 0.2" mass="1" contype="0" conaffinity="0"/>
  <geom type="{kind}" size="{size}" pos="0.03 0 -0.02" euler="{turn}" mass="0.5" contype="1" conaffinity="2"/>
</body>"""
FEET = {
    "box": ("box", "0.09 0.04 0.02", "0 0 0"),
    "cylinder": ("cylinder", "0.06 0.02", "0 0 0"),
    "capsule": ("capsule", "0.02 0.07", "0 90 0"),
    "sphere": ("sphere", "0.03", "0 0 0"),
    "ellipsoid": ("ellipsoid", "0.09 0.04 0.02", "0 0 0"),
}
LIMP = "    def __init__(self, setup):\n        self.n = len(setup.torque_limit)\n\n" \
       "    def torques(self, sensed):\n        return np.zeros(self.n)\n"  # fmt: skip


@pytest.fixture(params=FEET)
def robot(request, tmp_path):
    """A scenario of a small robot with feet of a kind, and a law that does nothing."""
    kind, size, turn = FEET[request.param]
    legs = "".join(LEG.format(name=name, y=y, kind=kind, size=size, turn=turn) for name, y in (("r", -0.1), ("l", 0.1)))
    (tmp_path / "m.xml").write_text(BOXES.format(legs=legs), encoding="utf-8")
    path = tmp_path / "s.toml"
    path.write_text(f'model = "{tmp_path / "m.xml"}"\nduration = 0.4\nfall.height = 0.01\nfall.tilt = 180.0\n')
    return str(path), law_of(tmp_path, LIMP)


def dropped(robot, ramp: bool):
    """A limp robot that flies into a slope, or into a ramp as steep, seen from the ramp's lower end."""
    plan = plan_of(robot[0], (robot[1], "ground.friction=0.8", f"ground.slope={0.0 if ramp else math.degrees(ANGLE)}"))
    run = plan.run(0)
    q, v = run.q.copy(), run.v.copy()
    q[2] += 0.05
    v[:6] = 0.6, 0.3, -0.5, 0.4, -1.0, 0.2
    if ramp:
        c, s = math.cos(ANGLE), math.sin(ANGLE)
        turn = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        q[:3], v[:3] = turn @ q[:3] + [FOOT + 1.0, 0.0, math.tan(ANGLE)], turn @ v[:3]
        turned = np.empty(4)
        mujoco.mju_mulQuat(turned, np.array([math.cos(ANGLE / 2), 0.0, -math.sin(ANGLE / 2), 0.0]), q[3:7])
        q[3:7] = turned
        long = 10.0 / math.tan(ANGLE)
        steps = Steps(rise=10.0, run=2.0 * long, ramp=long, start=FOOT)
        run = replace(run, scenario=structs.replace(run.scenario, ground=Ground(steps=steps, friction=0.8)))
    return simulate(replace(run, q=q, v=v))


def test_a_ramp_is_a_slope(robot):
    """Rotated by its angle, what happens on a ramp is what happens on a slope: impacts, friction, forces."""
    slope, ramp = dropped(robot, False), dropped(robot, True)
    assert slope.end == ramp.end == "completed"
    assert (slope.force[..., 2] > 10.0).any(axis=1).sum() > 50  # it did land
    c, s = math.cos(ANGLE), math.sin(ANGLE)
    turn = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    np.testing.assert_allclose(ramp.q[:, :3], slope.q[:, :3] @ turn.T + [FOOT + 1.0, 0.0, math.tan(ANGLE)], atol=1e-4)
    np.testing.assert_allclose(ramp.q[:, 7:], slope.q[:, 7:], atol=1e-3)
    np.testing.assert_allclose(ramp.ground_force[:200], slope.ground_force[:200] @ turn.T, atol=2.0)
    np.testing.assert_array_equal(ramp.contact[:150], slope.contact[:150])


@pytest.mark.parametrize("model", ["h1", "walker2d", "humanoid"])
def test_before_the_first_step_it_is_as_on_the_level(model):
    level, far = stood(model), stood(model, FAR)
    assert not far.ground.level
    np.testing.assert_allclose(far.q, level.q, atol=1e-5)
    np.testing.assert_allclose(far.force, level.force, atol=1e-3 * np.abs(level.force).max())
    np.testing.assert_array_equal(far.contact, level.contact)


def test_a_walk_over_tiles():
    """The thesis's law in Python, which feels nothing of the ground but by its feet."""
    t = simulate(
        plan_of("any/walk", ("duration=4.0", "ground.tiles={height=0.006,start=0.5}", "start.jitter=0")).run(0)
    )
    assert t.end == "completed"
    standing = t.contact > 0.0
    below = t.ground.height(t.point[..., 0])
    assert np.ptp(below[standing]) > 0.003  # it did stand high and low
    assert np.abs(t.point[..., 2] - below)[standing].max() < 0.01
    numbers = assess(t, (0.0, 4.0)).numbers
    assert numbers["walked"]
    assert numbers["penetration"] < 0.01
    assert max(numbers["energy_residual"], numbers["momentum_residual"]) < 1e-2


def test_the_ground_is_kept_with_a_run(tmp_path):
    t = stood("walker2d", "ground.tiles={height=0.01,start=0.5}")
    t.save(tmp_path / "t.npz")
    failures.save_packed(t.last(0.2), tmp_path / "t.xz")
    for kept in (load(tmp_path / "t.npz"), failures.load_packed(tmp_path / "t.xz")):
        np.testing.assert_array_equal(kept.ground.x, t.ground.x)
        np.testing.assert_array_equal(kept.ground.z, t.ground.z)
    assert load(tmp_path / "t.npz").about == t.about
    assert "ground" not in stood("walker2d").about


def test_runs_share_a_model_that_no_run_moves_and_pictures_have_no_planes():
    plans = [plan_of(named("walker2d"), (f"ground.tiles={{height={height}}}",)) for height in (0.01, 0.02)]
    models = [compiled(plan.model, plan.scenario, "torque") for plan in plans]
    assert models[0] is models[1]
    before = models[0].geom_pos.copy()
    for plan in plans:
        simulate(plan.run(0))
    np.testing.assert_array_equal(models[0].geom_pos, before)
    shown = visual_model(plans[0].model, plans[0].scenario)
    assert shown.ngeom == mujoco.MjModel.from_xml_path(str(plans[0].model)).ngeom


def test_tiles_begin_beyond_the_feet_and_the_law_in_space_refuses_them():
    with pytest.raises(InputError, match=r"ground.tiles.start: expected a place beyond the feet, the foremost point .*"
                       r"got 0$"):  # fmt: skip
        plan_of(named("h1"), ("ground.tiles={height=0.01,start=0.0}",))
    with pytest.raises(InputError, match=r"ground.steps: expected none: the law 'thesis' walks on level ground"):
        plan_of("spatial/level", ("ground.steps={rise=0.01,start=2.0}",))


def test_rises_are_those_of_the_pieces():
    profile = profile_of(Ground(steps=Steps(rise=0.1, run=1.0, ramp=0.5, start=1.0, number=2)), 0)
    np.testing.assert_allclose(profile.rise(np.array([0.0, 1.0, 1.4, 1.5, 2.2, 9.0])), [0.0, 0.2, 0.2, 0.0, 0.2, 0.0])
    assert not profile_of(Ground(), 0).rise(np.array([1.0])).any()
