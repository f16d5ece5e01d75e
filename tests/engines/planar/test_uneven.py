"""Ground that is not level, in both engines: against a slope, against MuJoCo's own forces, and against each other."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from msgspec import structs

from biped.engines import home
from biped.engines.home import simulate_with_ledger
from biped.engines.planar import mujoco as foreign
from biped.engines.planar.ground import lay, planes_of
from biped.ensemble.failures import load_packed, save_packed
from biped.ensemble.plan import Plan
from biped.measure import stored
from biped.measure.metrics import measure
from biped.robot.ground import gravity, profile_of
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.tree import motion
from biped.scenario.devices import Actuation
from biped.scenario.keys import Fall, Scenario, Start
from biped.scenario.reading import read_scenario
from biped.scenario.world import Ground, Steps, Tiles
from tests.energy import energy

ENGINES = {"mujoco": foreign, "home": home}
ANGLE = math.radians(20.0)
FOOT = 2.0
"""[m] where the ramp begins."""
LIMP = Actuation(torque_limit=1e-9)


def walk(engine, *changes):
    plan = Plan(read_scenario("robust/level", ["sweep={}", "randomise.runs=1", *changes]))
    return ENGINES[engine].simulate(plan.run(0))


def dropped(engine, ramp):
    """A limp biped that flies into a slope, or into a ramp as steep, seen from the ramp's lower end."""
    q = (1.5, 1.4, 1.4, 1.9, 1.2, 0.3, 1.2, 0.6, -0.4)
    v = (0.7, -1.5, 0.5, -1.5, -2.0, 1.0, 0.8, -0.5, 2.0)
    s = Scenario(
        duration=0.4, start=Start(q=q, v=v, settle=False), actuation=LIMP, fall=Fall(height=0.01, tilt=180.0),
        ground=Ground(slope=0.0 if ramp else math.degrees(ANGLE), friction=0.8),
    )  # fmt: skip
    run = Plan(s).run(0)
    if ramp:
        long = 10.0 / math.tan(ANGLE)
        steps = Steps(rise=10.0, run=2.0 * long, ramp=long, start=FOOT)
        c, sn = math.cos(ANGLE), math.sin(ANGLE)
        turn = np.array([[c, -sn], [sn, c]])
        at, velocity = run.q.copy(), run.v.copy()
        at[:2], velocity[:2] = turn @ at[:2] + [FOOT, 0.0], turn @ velocity[:2]
        at[2] += ANGLE
        run = replace(run, scenario=structs.replace(s, ground=structs.replace(s.ground, steps=steps)), q=at, v=velocity)
    return ENGINES[engine].simulate(run)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_ramp_is_a_slope(engine):
    """Rotated by its angle, what happens on a ramp is what happens on a slope: impacts, friction, forces."""
    slope, ramp = dropped(engine, False), dropped(engine, True)
    assert slope.end == ramp.end == "completed"
    assert (slope.column("force")[..., 1] > 100.0).sum() > 20  # it did land
    c, s = math.cos(ANGLE), math.sin(ANGLE)
    turn = np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(ramp.q[:, :2], slope.q[:, :2] @ turn.T + [FOOT, 0.0], atol=1e-6)
    np.testing.assert_allclose(ramp.q[:, 3:], slope.q[:, 3:], atol=1e-6)
    largest = np.abs(slope.column("force")).max()
    np.testing.assert_allclose(ramp.column("force"), slope.column("force") @ turn.T, atol=1e-4 * largest)


def test_logged_forces_are_all_of_mujocos_constraint_forces():
    s = read_scenario("robust/level", ["sweep={}", "randomise.runs=1", "duration=4.0", "window.end=4.0",
                                       "window.start=0.0", "ground.tiles.height=0.015", "ground.tiles.length=0.3",
                                       "ground.tiles.start=0.6", "ground.tiles.ramp=0.1"])  # fmt: skip
    run = Plan(s).run(0)
    t, model, order = foreign.simulate(run), *compile_foreign(run.model, run.scenario)[:2]
    data = mujoco.MjData(model)
    planes = planes_of(model, data, t.robot, profile_of(run.scenario.ground, run.seed))
    tilted = 0
    for k in range(0, len(t), 3):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = t.q[k], t.v[k], t.applied[k]
        mujoco.mj_kinematics(model, data)
        lay(planes, data.geom_xpos, order.points)
        mujoco.mj_forward(model, data)
        total = np.zeros(9)
        total[[4, 7]] = t.stop[k]
        for i, point in enumerate(t.robot.points):
            J = np.zeros((3, 9))
            place, plane = data.site(point).xpos, planes.geoms[i]
            normal = data.geom_xmat[plane].reshape(3, 3)[:, 2]
            depth = (place - data.geom_xpos[plane]) @ normal
            tilted += int(abs(normal[0]) > 0.05 and t.column("force")[k, i, 1] > 10.0)
            # MuJoCo's contact lies half-way between the point and the ground above it.
            mujoco.mj_jac(model, data, J, None, place - 0.5 * depth * normal, model.site(point).bodyid[0])
            total += t.column("force")[k, i] @ J[[0, 2]]
        np.testing.assert_allclose(total, data.qfrc_constraint, atol=1e-4 * max(1.0, np.abs(total).max()), err_msg=k)
    assert tilted > 20


@pytest.fixture(scope="module")
def at_home():
    changes = ["duration=8.0", "window.end=8.0", "window.start=0.0", "ground.tiles.height=0.015"]
    run = Plan(read_scenario("robust/level", ["sweep={}", "randomise.runs=1", *changes])).run(0)
    true_advance, active = home.advance, []

    def advance(rigid, *rest):
        true_advance(rigid, *rest)
        active.append(rigid[0]["contact"]["active"].copy())

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(home, "advance", advance)
        patch.setattr(home, "COMPILED", False)  # tick by tick, so that it can be watched
        trajectory, rigid = simulate_with_ledger(run)
    return trajectory, rigid, profile_of(run.scenario.ground, run.seed), np.array(active)


def test_rigid_points_stand_on_the_ground_and_never_go_through(at_home):
    t, _, profile, active = at_home
    assert t.end == "completed"
    point = motion(t.tree, t.q, t.v).point
    above = point[..., 1] - profile.height(point[..., 0])
    assert above.min() > -1e-8
    standing = active[:-1, :4].astype(bool)  # after tick k, which is row k + 1
    assert np.abs(above[1:][standing]).max() < 1e-8
    assert np.ptp(profile.height(point[1:, :, 0][standing])) > 0.015  # it did stand high and low


def test_rigid_energy_and_momentum_add_up(at_home):
    t, rigid, *_ = at_home
    w = rigid[0]
    ends = np.array([t.q[0], w["state"]["q0"]]), np.array([t.v[0], w["state"]["v0"]])
    before, after = energy(t.tree, *ends, t.slope)
    assert w["ledger"]["least_loss"] > -1e-9
    assert after - before == pytest.approx(w["ledger"]["work"] - w["ledger"]["loss"], abs=1e-3)
    mass = t.tree.mass
    momentum = np.tensordot(motion(t.tree, *ends).com_velocity, mass, (1, 0))
    impulse = t.tick * (t.column("force").sum(axis=(0, 1)) + len(t) * mass.sum() * np.array(gravity(0.0)))
    np.testing.assert_allclose(impulse, momentum[1] - momentum[0], atol=1e-6 * len(t) * t.tick * mass.sum() * 9.81)
    numbers = measure(t, (0.0, 8.0))
    assert numbers["penetration"] < 1e-8
    assert 0.0 < numbers["clearance"] < 0.2


def test_both_engines_walk_alike_over_tiles():
    changes = ["duration=10.0", "ground.tiles.height=0.01", "seed=5"]
    here, there = (measure(walk(engine, *changes), (5.0, 10.0)) for engine in ENGINES)
    assert here["walked"] == there["walked"] == 1
    assert here["speed"] == pytest.approx(there["speed"], rel=0.1)
    assert max(here["penetration"], there["penetration"]) < 0.003
    assert max(here["momentum_residual"], there["momentum_residual"]) < 1e-3


def test_heights_are_sensed_above_the_ground_below():
    t = walk("mujoco", "duration=4.0", "window={}", "ground.steps.rise=0.02", "ground.steps.number=3")
    point = motion(t.tree, t.q, t.v).point
    assert t.ground.height(point[..., 0]).max() > 0.03
    np.testing.assert_allclose(t.height, point[..., 1] - t.ground.height(point[..., 0]), atol=1e-12)


def test_a_walk_downstairs_is_no_fall():
    """The torso ends lower than where a fall would end the run on level ground, but stays above the ground."""
    t = walk("mujoco", "duration=12.0", "ground.steps={rise=-0.01,run=0.2,number=30,start=0.6}", "fall.height=0.8")
    fallen = 0.8 * t.q[0, 1]
    assert t.end == "completed"
    assert t.q[:, 1].min() < fallen
    assert (t.q[:, 1] - t.ground.height(t.q[:, 0])).min() > fallen


def test_the_ground_is_kept_with_a_run(tmp_path):
    t = walk("mujoco", "duration=1.0", "window={}", "ground.tiles.height=0.01")
    t.save(tmp_path / "a.npz")
    save_packed(t, tmp_path / "b.xz")
    for kept in (stored.load(tmp_path / "a.npz"), load_packed(tmp_path / "b.xz")):
        np.testing.assert_array_equal(kept.ground.x, t.ground.x)
        np.testing.assert_array_equal(kept.ground.z, t.ground.z)
    assert not t.flat


def test_runs_share_a_model_that_no_run_moves():
    scenarios = [Scenario(ground=Ground(tiles=Tiles(height=h)), duration=0.1) for h in (0.01, 0.02)]
    runs = [Plan(s).run(0) for s in scenarios]
    models = [compile_foreign(run.model, run.scenario).model for run in runs]
    assert models[0] is models[1]
    before = models[0].geom_pos.copy()
    for run in runs:
        foreign.simulate(run)
    np.testing.assert_array_equal(models[0].geom_pos, before)
