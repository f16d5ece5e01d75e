"""The home engine as physics: what must be conserved is, what must hold holds, and it converges."""

import numpy as np
import pytest

from biped.engines import home
from biped.engines.home import simulate_with_ledger
from biped.engines.planar import mujoco
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.robot.ground import GRAVITY, gravity
from biped.robot.planar.tree import motion
from biped.scenario.reading import read_scenario
from tests.energy import energy

GAITS = ("slow", "normal", "fast", "style")
FLYING = ["start.q=[0,3.0,1.4,1.9,1.2,0.3,1.2,0.6,-0.4]", "start.v=[0.7,1.2,0.5,-1.5,-2.0,1.0,0.8,-0.5,2.0]",
          "start.settle=false", "window.start=0.0", "fall.height=0.1", "fall.tilt=180"]  # fmt: skip


def plan(name, *changes):
    return Plan(read_scenario(name, list(changes)))


def short(name, duration, *changes):
    return plan(name, f"duration={duration}", "window.start=0.0", f"window.end={duration}", *changes).run(0)


def watched(run):
    """A run's trajectory, the engine's record at its end, and what that knew of contacts after every tick."""
    contacts = []
    true_advance = home.advance

    def advance(rigid, q, v, step, steps):
        true_advance(rigid, q, v, step, steps)
        contacts.append(rigid[0]["contact"].copy())

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(home, "advance", advance)
        patch.setattr(home, "COMPILED", False)  # tick by tick, so that it can be watched
        trajectory, rigid = simulate_with_ledger(run)
    return trajectory, rigid[0], np.array(contacts)


@pytest.fixture(scope="module")
def walk():
    """Ten seconds of the normal gait, watched, and the motion of its points."""
    trajectory, w, contacts = watched(plan("level_normal_generalized").run(0))
    return trajectory, w, contacts, motion(trajectory.tree, trajectory.q, trajectory.v)


def test_stance_points_stay_where_they_landed(walk):
    trajectory, _, contacts, moved = walk
    assert trajectory.end == "completed"
    active, anchor = contacts["active"], contacts["anchor"]
    touching = active[:-1, :4].astype(bool)  # after tick k, which is row k + 1
    standing = touching & ~contacts["slides"][:-1].astype(bool)
    assert 1.0 < standing.sum(axis=1).mean() < 3.0
    assert np.abs(moved.point[1:, :, 0] - anchor[:-1])[standing].max() < 1e-9
    assert np.abs(moved.point[1:, :, 1])[touching].max() < 1e-9
    # Velocities are corrected with the values at a step's start, so one step's error remains in them.
    assert np.abs(moved.point_velocity[1:])[standing].max() < 1e-7
    locked = active[:-1, 4:].astype(bool)
    assert locked.any()
    assert np.abs(trajectory.q[1:, [4, 7]][locked]).max() < 1e-12


def test_nothing_goes_through_the_ground_or_a_knee_stop(walk):
    trajectory, _, _, moved = walk
    assert moved.point[..., 1].min() > -1e-8
    assert trajectory.q[:, [4, 7]].max() < 1e-8


def test_the_ground_pushes(walk):
    trajectory, _, contacts, _ = walk
    held = contacts["held"]
    held_now = held[: len(trajectory), :4].any(axis=1)
    assert held_now.mean() < 0.01
    assert trajectory.column("force")[~held_now][..., 1].min() > -1e-3
    assert trajectory.stop[~held[: len(trajectory), 4:].any(axis=1)].max() < 1e-3
    weight = trajectory.tree.mass.sum() * GRAVITY
    # Mean force is weight up to the change of momentum: impacts are in the rows in which they happen.
    tolerance = 1e-8 * weight * trajectory.time[-1]
    ends = motion(trajectory.tree, trajectory.q[[0, -1]], trajectory.v[[0, -1]]).com_velocity
    gained = np.diff(np.tensordot(ends, trajectory.tree.mass, (1, 0)), axis=0)[0]
    impulse = trajectory.tick * trajectory.column("force")[:-1].sum(axis=(0, 1))
    impulse[1] -= weight * trajectory.time[-1]
    np.testing.assert_allclose(impulse, gained, rtol=0, atol=tolerance)


def test_a_point_that_friction_alone_would_lift_slides_on_ground_that_pushes():
    """`rough_terrain` on level ground: for a quarter of a second a toe that is left behind is about to leave."""
    run = plan("upright/cells/level", "engine=home", "controller=rough_terrain", "seed=3131", "duration=3.0").run(3)
    trajectory, w, contacts = watched(run)
    slides = (contacts["slides"].astype(bool) & contacts["active"][:, :4].astype(bool))[:-1]
    assert 20 < slides.any(axis=1).sum() < 200
    moved = motion(trajectory.tree, trajectory.q, trajectory.v)
    assert np.abs(moved.point[1:, :, 1][slides]).max() < 1e-9
    assert np.abs(moved.point_velocity[1:, :, 1][slides]).max() < 1e-6
    assert np.abs(moved.point_velocity[1:, :, 0][slides]).max() > 1e-3
    pulling = (trajectory.foot_force < -1e-3 * trajectory.mass * GRAVITY).any(axis=1)
    assert pulling.sum() < 5
    assert trajectory.warnings["chattering_steps"] < 60
    e = energy(trajectory.tree, np.array([trajectory.q[0], w["state"]["q0"]]),
               np.array([trajectory.v[0], w["state"]["v0"]]), trajectory.slope)  # fmt: skip
    assert e[1] - e[0] == pytest.approx(w["ledger"]["work"] - w["ledger"]["loss"], abs=1e-4)
    assert w["ledger"]["least_loss"] > -1e-9


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("level_normal_generalized", []),
        ("level_normal", []),
        ("level_fast_generalized", ["ground.slope=-2.0", "push=[{at=1.0,duration=0.2,force=[60.0,20.0]}]"]),
        ("level_normal", ["truth.joint_damping=0.5", "truth.mass=[1.1,1,1,1,1,1,1]"]),
    ],
    ids=["walk", "joint torques", "slope and push", "damped, heavier"],
)
def test_work_explains_all_energy_but_impact_losses_which_are_never_negative(name, changes):
    run = short(name, 4.0, *changes)
    trajectory, rigid = simulate_with_ledger(run)
    w = rigid[0]
    e = energy(
        trajectory.tree,
        np.array([trajectory.q[0], w["state"]["q0"]]),
        np.array([trajectory.v[0], w["state"]["v0"]]),
        trajectory.slope,
    )
    assert w["ledger"]["impacts"] > 20
    assert w["ledger"]["loss"] > 5.0
    assert w["ledger"]["least_loss"] > -1e-9
    assert e[1] - e[0] == pytest.approx(w["ledger"]["work"] - w["ledger"]["loss"], abs=1e-4)
    if run.scenario.truth.joint_damping == 0.0:  # which the metric does not know of
        # The metric sees only the log, once per tick, impacts within it included.
        assert measure(trajectory, (0.0, 4.0))["energy_residual"] < 0.01


def test_momentum_in_flight():
    run = short("level_normal", 0.4, *FLYING)
    trajectory, rigid = simulate_with_ledger(run)
    assert not trajectory.column("force").any()
    # Torques act, and a knee hits its stop, but both are internal.
    assert np.abs(trajectory.u).max() > 10.0
    assert rigid[0]["ledger"]["impacts"] == 1
    tree = trajectory.tree
    m = motion(tree, trajectory.q, trajectory.v)
    mass = tree.mass
    linear = np.tensordot(m.com_velocity, mass, (1, 0))
    fall = linear[0] + mass.sum() * np.outer(trajectory.time, gravity(0.0))
    np.testing.assert_allclose(linear, fall, rtol=0, atol=1e-8)
    centre = np.tensordot(m.com, mass, (1, 0)) / mass.sum()
    arm, way = m.com - centre[:, None], m.com_velocity - linear[:, None] / mass.sum()
    spin = (mass * (arm[..., 0] * way[..., 1] - arm[..., 1] * way[..., 0])).sum(axis=1) + m.rate @ tree.inertia
    np.testing.assert_allclose(spin, spin[0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("mode", ["joint", "generalized"])
def test_flight_is_mujocos_to_integration_error(mode):
    changes = [*FLYING, f"actuation.mode={mode}", "push=[{at=0.1,duration=0.1,force=[30.0,-10.0],body='left_shank'}]"]
    here = home.simulate(short("level_normal", 0.3, *changes))
    there = mujoco.simulate(short("level_normal", 0.3, *changes, "simulation.integrator=RK4"))
    assert len(here) == len(there) == 300
    np.testing.assert_allclose(here.q, there.q, rtol=0, atol=1e-8)
    np.testing.assert_allclose(here.v, there.v, rtol=0, atol=1e-6)


def converging(name, duration, *changes):
    """Coordinates at the end, and energy that is not explained, by the number of steps in a tick."""
    end, left = {}, {}
    for part in (1, 2, 4, 32):
        run = short(name, duration, f"simulation.timestep={1e-3 / part}", *changes)
        trajectory, rigid = simulate_with_ledger(run)
        w = rigid[0]
        assert w["ledger"]["impacts"] > 5
        end[part] = w["state"]["q0"].copy()
        e = energy(
            trajectory.tree,
            np.array([trajectory.q[0], w["state"]["q0"]]),
            np.array([trajectory.v[0], w["state"]["v0"]]),
            0.0,
        )
        left[part] = abs(e[1] - e[0] - w["ledger"]["work"] + w["ledger"]["loss"])
    return end, left


def test_the_first_half_second_converges():
    """Slips, heel strike, knee stops and releases of it are located."""
    end, _ = converging("level_normal_generalized", 0.5)
    assert np.abs(end[1] - end[32]).max() < 1e-9
    assert np.abs(end[2] - end[32]).max() < 1e-10


def test_converges_with_the_fourth_power_of_the_step():
    """Heel strike, knee stops and releases are located, so the order survives them where no foot rocks."""
    _, left = converging("level_fast_generalized", 0.7, "start.posture=single")
    for coarse, fine in ((1, 2), (2, 4)):
        assert 3.5 < np.log2(left[coarse] / left[fine]) < 4.5


def test_steady_speed_does_not_depend_on_the_step():
    speeds = [
        measure(home.simulate(plan("level_normal_generalized", f"simulation.timestep={step}").run(0)), (5.0, 10.0))[
            "speed"
        ]
        for step in (1e-3, 5e-4, 2.5e-4)
    ]
    assert max(speeds) / min(speeds) - 1.0 < 0.01


@pytest.mark.parametrize("gait", GAITS)
def test_published_gaits_agree_with_mujoco(gait):
    numbers = {
        engine.__name__: measure(engine.simulate(plan(f"level_{gait}_generalized").run(0)), (5.0, 10.0))
        for engine in (home, mujoco)
    }
    here, there = numbers[home.__name__], numbers[mujoco.__name__]
    assert here["speed"] == pytest.approx(there["speed"], rel=0.02)
    assert here["cost_of_transport"] == pytest.approx(there["cost_of_transport"], rel=0.10)
    assert here["support"] == pytest.approx(1.0, abs=0.02)


def test_a_start_inside_the_ground_or_with_inconsistent_speed_settles():
    run = short("level_normal_generalized", 0.2, "start.v=[0.5,-0.4,0,0,0,0,0,0,0]")
    trajectory, rigid = simulate_with_ledger(run)
    assert rigid[0]["ledger"]["impacts"] >= 1
    moved = motion(trajectory.tree, trajectory.q, trajectory.v)
    assert moved.point[..., 1].min() > -1e-8
    sunk = short("level_normal_generalized", 0.2, "start.q=[0,1.24,1.5,1.86,1.86,0,1.23,1.23,0]", "start.settle=false")
    assert motion(trajectory.tree, sunk.q, sunk.v).point[:, 1].min() < -1e-3
    trajectory = home.simulate(sunk)
    assert motion(trajectory.tree, trajectory.q[1:], trajectory.v[1:]).point[..., 1].min() > -1e-8
    assert trajectory.end == "completed"


def test_dead_weight_falls_and_comes_to_rest_on_its_knees_stops_without_stalling():
    """No torque at all: legs fold, everything chatters, and the run still ends, as a fall."""
    run = plan("level_normal", "actuation.torque_limit=1e-9").run(0)
    trajectory = home.simulate(run)
    assert trajectory.end == "fell"
    assert np.isfinite(trajectory.log).all()


def test_same_run_same_bytes():
    run = short("level_fast", 1.0)
    assert home.simulate(run).log.tobytes() == home.simulate(run).log.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("gait", GAITS)
def test_sixty_seconds_without_drift(gait):
    trajectory, _, contacts = watched(plan(f"level_{gait}_generalized", "duration=60.0", "window.end=60.0").run(0))
    assert trajectory.end == "completed"
    assert trajectory.q[-1, 0] > 40.0
    touching = contacts["active"][:-1, :4].astype(bool)
    standing = touching & ~contacts["slides"][:-1].astype(bool)
    point = motion(trajectory.tree, trajectory.q, trajectory.v).point[1:]
    assert np.abs(point[..., 0] - contacts["anchor"][:-1])[standing].max() < 1e-6
    assert np.abs(point[..., 1])[touching].max() < 1e-6
