"""Metrics: real runs against independent recomputation, made-up runs against known answers."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from biped.engines.mujoco import simulate
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.measure.metrics import aggregate, measure
from biped.measure.metrics.energy import energy
from biped.measure.metrics.gait import commonest_cycle, strikes
from biped.measure.metrics.ground import centre_of_pressure
from biped.measure.metrics.walking import walked
from biped.measure.trajectory import Trajectory
from biped.robot.model import compile_foreign
from biped.robot.tree import motion
from biped.scenario.actuation import Actuation
from biped.scenario.ground import Ground
from biped.scenario.keys import Scenario, Simulation, Start, Truth
from biped.scenario.metrics import METRICS
from tests.runs import SCENARIOS, made, mirrored, synthetic, tree
from tests.ticks import HUMAN

WEIGHT = 75.0 * 9.81


def residual(t: Trajectory) -> float:
    return measure(t, (0.0, t.time[-1]))["energy_residual"]


def test_every_name_is_measured():
    numbers = measure(made("walk"), (0.0, 2.0))
    assert set(METRICS) <= set(numbers)
    missing = [name for name in METRICS if not math.isfinite(numbers[name])]
    # Two seconds have one step, which alternates with none; neither motors nor an estimator; no push, no change.
    motors = ["cost_of_transport_heat", "cost_of_transport_electrical", "motor_load", "gear_load", "beyond_gear"]
    posture = ["torso_error", "torso_error_worst", "underactuated", "longest_gap", "gyro_clipped"]
    pushes = ["push_impulse", "push_speed", "push_froude", "recovery_time"]
    steps = ["first_step", "second_step", "third_step", "fourth_step"]
    general = ["duty", "step_duration", "step_width", "cross_over", "margin_of_stability", "heading", "drift"]
    assert sorted(missing) == sorted(
        ["alternation", "stopping_distance", "seat_load", *motors, "beyond_line", *posture, *pushes, *steps, *general]
    )


@pytest.mark.parametrize("name", ["walk", "generalized"])
def test_support_is_mujocos_vertical_force_over_weight(name):
    """Mean of qfrc_constraint on the torso's height, set up afresh at every row of the window."""
    t = made(name)
    model = compile_foreign(HUMAN, SCENARIOS[name]).model
    data = mujoco.MjData(model)
    rows = range(500, len(t))
    vertical = []
    for k in rows:
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = t.q[k], t.v[k], t.applied[k]
        mujoco.mj_forward(model, data)
        vertical.append(data.qfrc_constraint[1])
    support = measure(t, (0.5, 2.0))["support"]
    assert support == pytest.approx(np.mean(vertical) / WEIGHT, rel=1e-6)


def test_vertical_momentum_explains_the_support():
    """Impulse of the ground less that of gravity is the change of momentum: Newton, whatever the engine says."""
    t = made("walk")
    whole = motion(t.tree, t.q, t.v)
    momentum = (t.tree.mass[:, None] * whole.com_velocity).sum(axis=1)
    impulse = 0.001 * (t.force[:-1].sum(axis=(0, 1)) - [0.0, WEIGHT * (len(t) - 1)])
    np.testing.assert_allclose(momentum[-1] - momentum[0], impulse, atol=0.2)


def test_energy_is_mujocos():
    for slope in (0.0, 4.0):
        model = compile_foreign(HUMAN, Scenario(ground=Ground(slope=slope))).model
        model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        data = mujoco.MjData(model)
        rng = np.random.default_rng(0)
        for _ in range(10):
            data.qpos[:], data.qvel[:] = rng.normal(size=9), rng.normal(size=9)
            mujoco.mj_forward(model, data)
            assert energy(tree(), data.qpos, data.qvel, slope) == pytest.approx(data.energy.sum(), abs=1e-9)


@pytest.mark.parametrize("name", ["walk", "slope", "slippery", "pushed", "generalized", "pyramidal"])
def test_energy_is_accounted_for(name):
    assert residual(made(name)) < 0.02


def test_energy_residual_falls_with_the_step():
    coarse, fine = (
        residual(simulate(Plan(Scenario(
            duration=0.4, start=Start(posture="flat", settle=True), ground=Ground(contact_time=0.02),
            simulation=Simulation(timestep=step, control_rate=1.0 / step),
        )).run(0))) for step in (1e-3, 1.25e-4)
    )  # fmt: skip
    assert fine < 0.5 * coarse


def test_energy_that_comes_from_nowhere_is_noticed():
    t = made("walk")
    forged = replace(t, log=t.log.copy())
    forged.v[-1] *= 1.5
    assert residual(forged) > 10 * residual(t)
    cheated = replace(t, log=t.log.copy())
    cheated.u[:] *= 1.2
    assert residual(cheated) > 10 * residual(t)


def test_costs_of_transport_by_hand():
    t = made("walk")
    rows = slice(500, 2000)
    power = t.u[rows] * t.v[rows, 3:]
    work = WEIGHT * abs(t.q[1999, 0] - t.q[500, 0])
    numbers = measure(t, (0.5, 2.0))
    assert numbers["cost_of_transport"] == pytest.approx(0.001 * sum(abs(p.sum()) for p in power) / work)
    assert numbers["cost_of_transport_absolute"] == pytest.approx(0.001 * np.abs(power).sum() / work)
    assert numbers["cost_of_transport_positive"] == pytest.approx(0.001 * power[power > 0].sum() / work)
    assert numbers["peak_power"] == pytest.approx(np.abs(power).max())
    assert numbers["mean_torque"] == pytest.approx(np.abs(t.u[rows]).mean())
    assert numbers["per_joint"]["knee"]["peak_torque"] == pytest.approx(np.abs(t.u[rows][:, [1, 4]]).max())


def test_generalized_power_is_that_of_the_springs():
    """Q_d's power is the power of the seven spring-dampers: what flows into the joint coordinates, no more."""
    t = made("generalized")
    rows = slice(500, 1000)
    total = (t.Q_d[rows] * t.v[rows]).sum(axis=1)
    work = WEIGHT * abs(t.q[999, 0] - t.q[500, 0])
    numbers = measure(t, (0.5, 1.0))
    assert numbers["cost_of_transport"] == pytest.approx(0.001 * np.abs(total).sum() / work)


@pytest.mark.parametrize("name", ["walk", "pushed", "generalized"])
def test_right_and_left_are_alike(name):
    t = made(name)
    window = (0.0, t.time[-1])
    one, two = measure(t, window), measure(mirrored(t), window)
    for key in METRICS:
        assert two[key] == pytest.approx(one[key], rel=1e-9, nan_ok=True), key
    for joint in one["per_joint"]:
        assert two["per_joint"][joint] == pytest.approx(one["per_joint"][joint])


def test_leg_states_of_the_mirrored_run_are_the_other_legs():
    t = made("walk")
    mirror = commonest_cycle(mirrored(t), slice(0, None))
    left = [int(s) for s in t.phase[:, 1]]
    changes = [s for before, s in zip([0, *left], left, strict=False) if s != before]
    assert mirror["cycle"].split("-")[0] == "1"
    assert mirror["cycle"] in "-".join(map(str, changes))


def steady(**columns):
    """Two seconds at 0.5 m/s with upright legs; feet at q's places."""
    n = 2000
    q, v = np.zeros((n, 9)), np.zeros((n, 9))
    q[:, 0], q[:, 1], v[:, 0] = 0.5 * np.arange(n) * 0.001, 1.3, 0.5
    return synthetic(2.0, q=q, v=v, **columns)


def test_speed_of_a_steady_run():
    numbers = measure(steady(), (1.0, 2.0))
    assert numbers["speed"] == pytest.approx(0.5)
    assert numbers["speed_std"] == pytest.approx(0.0, abs=1e-12)
    assert numbers["distance"] == pytest.approx(0.5 * 1.999)
    assert numbers["time"] == pytest.approx(2.0)
    leg = (0.245 + 0.246 + 0.039) * 1.8
    assert numbers["froude"] == pytest.approx(0.5 / math.sqrt(9.81 * leg), rel=1e-6)


def borne(t: Trajectory) -> Trajectory:
    """The run with its weight on the right foot and no energy that comes from nowhere."""
    t.column("believed")[:, :2] = 1.0
    t.column("force")[:, :2, 1] = 0.5 * WEIGHT
    return t


def walking(**columns) -> Trajectory:
    """Three seconds at 0.5 m/s with a step of the right leg, then of the left, then of the right."""
    phase = np.ones((3000, 2))
    for start, leg in ((1600, 0), (2000, 1), (2400, 0)):
        phase[start : start + 200, leg] = 3
    q, v = np.zeros((3000, 9)), np.zeros((3000, 9))
    q[:, 0], q[:, 1], v[:, 0] = 0.5 * np.arange(3000) * 0.001, 1.3, 0.5
    return borne(synthetic(3.0, **({"q": q, "v": v, "phase": phase} | columns)))


def test_a_walk_is_steps_on_the_ground():
    window = (1.5, 3.0)
    walk = measure(walking(), window)
    assert (walk["walked"], walk["stood"], walk["falls"], walk["doubtful"]) == (1, 0, 0, 0)
    assert walk["alternation"] == 1.0
    sliding = walking(phase=np.ones((3000, 2)))
    assert measure(sliding, window)["walked"] == 0, "no step at all"
    hopping = walking()
    hopping.phase[:, 1] = 1
    assert measure(hopping, window)["walked"] == 0, "one leg only"
    flying = walking()
    flying.column("believed")[1500:2000] = 0.0
    assert measure(flying, window)["walked"] == 0, "a third of the window in the air"
    carried = walking()
    carried.column("force")[:, :2, 1] = 0.35 * WEIGHT
    lifted = measure(replace(carried, pushes=((0.0, 3.0, 0.0, 0.3 * WEIGHT, "torso"),)), window)
    assert (lifted["walked"], lifted["doubtful"]) == (0, 0), "carried by something else"
    slow = walking()
    slow.q[:, 0] *= 0.5
    assert measure(slow, window)["walked"] == 0


def test_walking_is_more_than_standing_or_falling():
    still = synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7])
    stood = measure(still, (1.0, 2.0))
    assert stood["walked"] == 0
    assert math.isnan(stood["cost_of_transport"])
    fell = measure(replace(walking(), end="fell", cause="fell forward at 1.999 s"), (1.0, 2.0))
    assert (fell["walked"], fell["falls"]) == (0, 1)


def test_standing_is_more_than_staying_up():
    still = borne(synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7]))
    assert measure(still, (1.0, 2.0))["stood"] == 1
    hovering = replace(synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7]), pushes=((0.0, 2.0, 0.0, WEIGHT, "torso"),))
    assert (measure(hovering, (1.0, 2.0))["stood"], measure(hovering, (1.0, 2.0))["doubtful"]) == (0, 0)
    assert measure(replace(still, end="fell", cause="fell forward at 1.999 s"), (1.0, 2.0))["stood"] == 0
    assert measure(steady(), (1.0, 2.0))["stood"] == 0
    swaying = borne(synthetic(2.0, q=np.outer(0.11 * np.sin(np.pi * np.arange(2000) / 500), np.eye(9)[0])))
    assert measure(swaying, (0.0, 2.0))["stood"] == 0
    steps = np.outer(1 + 2 * (np.arange(2000) % 500 > 250), [1, 0])
    stepping = borne(synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7], phase=steps))
    assert measure(stepping, (0.0, 2.0))["stood"] == 0


def test_a_run_that_ended_before_the_window_has_no_means():
    early = replace(borne(steady()), end="fell", cause="x")
    numbers = measure(early, (3.0, 4.0))
    assert math.isnan(numbers["speed"])
    assert math.isfinite(numbers["peak_torque"])
    assert numbers["falls"] == 1


def test_strikes_of_known_phases():
    phase = np.ones((1000, 2))
    phase[100:300, 0] = 3
    phase[250:300, 0] = 4
    phase[400:600, 1] = 3
    phase[700:740, 0] = 3  # a bounce of 40 rows
    phase[900:, 1] = 3  # not yet down
    assert strikes(phase, 0.001) == [(300, 0), (600, 1)]


def test_steps_and_support_of_known_contacts():
    believed, phase = np.ones((2000, 4)), np.ones((2000, 2))
    believed[1100:1300, :2], phase[1100:1300, 0] = 0, 3
    believed[1500:1800, :2], phase[1500:1800, 0] = 0, 3  # the same leg: with both, errors of either would cancel
    t = steady(believed=believed, phase=phase)
    t.q[:, 3], t.q[:, 6] = 0.3, -0.3  # right thigh ahead
    t.q[:, 5], t.q[:, 8] = -0.3, 0.3  # feet flat
    numbers = measure(t, (1.0, 2.0))
    assert numbers["steps"] == 2
    assert numbers["step_frequency"] == pytest.approx(2 / 0.999)
    assert numbers["step_length"] == pytest.approx(2 * math.sin(0.3) * 0.491 * 1.8, rel=1e-9)
    assert numbers["double_support"] == pytest.approx(0.5)
    assert numbers["flight"] == 0.0
    assert numbers["switches"] == pytest.approx(4 / 0.999)


def test_leg_state_cycle():
    one = [1] * 100 + [2] * 50 + [3] * 200 + [4] * 50
    odd = [1] * 100 + [3] * 300
    phase = np.ones((2000, 2))
    phase[:, 0] = one + one + odd + one + one
    found = commonest_cycle(steady(phase=phase), slice(0, None))
    assert found == {"cycle": "1-2-3-4", "share": 0.75}  # the last cycle has no end


def test_lean_is_forward_positive_and_from_the_vertical():
    t = steady()
    t.q[:, 2] = -math.radians(4.0)
    assert measure(t, (1.0, 2.0))["torso_lean"] == pytest.approx(4.0)
    # On a slope upward the ground's normal leans back: upright to the ground is leaning backward.
    assert measure(replace(t, slope=4.0), (1.0, 2.0))["torso_lean"] == pytest.approx(0.0, abs=1e-12)


def test_centre_of_pressure():
    force = np.zeros((3, 4, 2))
    force[0, :, 1] = [30.0, 10.0, 0.0, 50.0]
    force[1, :, 1] = [0.0, 0.0, 20.0, 0.0]
    at = centre_of_pressure(force)
    np.testing.assert_allclose(at[:2], [[0.75, 0.0], [math.nan, 1.0]])
    assert np.isnan(at[2]).all()


def test_slip_and_penetration():
    t = steady()
    t.column("force")[:, 1, 1] = 100.0  # the right heel carries load while everything slides along
    numbers = measure(t, (1.0, 2.0))
    assert numbers["slip"] == pytest.approx(1.0, rel=2e-3)
    lowest = 1.3 - (0.626 * 0.288 + 0.245 + 0.246 + 0.039) * 1.8
    assert numbers["penetration"] == pytest.approx(max(0.0, -lowest), abs=1e-9)
    sunk = steady()
    sunk.q[:, 1] -= lowest + 0.004
    assert measure(sunk, (1.0, 2.0))["penetration"] == pytest.approx(0.004, abs=1e-9)


def test_ensemble_means_are_over_walkers():
    walker = dict.fromkeys(METRICS, 1.0) | {"falls": 0, "diverged": 0, "doubtful": 0, "walked": 1, "stood": 0}
    runs = [walker, walker | {"speed": 2.0}, walker | {"speed": 9.0, "walked": 0, "falls": 1}]
    whole = aggregate(runs)
    assert (whole["falls"], whole["walked"], whole["speed"]) == (1, 2, 1.5)
    assert aggregate(runs[2:])["speed"] == 9.0
    assert math.isnan(aggregate([runs[2] | {"speed": math.nan}])["speed"])


@pytest.mark.parametrize("engine", ["mujoco", "home"])
def test_damped_joints_are_accounted_for(engine):
    walk = Scenario(
        duration=1.5, engine=engine, start=Start(posture="heel_toe"), actuation=Actuation(mode="generalized"),
        truth=Truth(joint_damping=2.0),
    )  # fmt: skip
    t = campaign.simulate(Plan(walk).run(0))
    assert residual(t) < 5e-3
    undamped = replace(t, tree=t.tree._replace(damping=np.zeros(6)))
    assert residual(undamped) > 10.0 * residual(t)


@pytest.mark.parametrize("rate", [500.0, 2000.0])
def test_metrics_count_seconds_not_rows(rate):
    """One run, its rows taken at another rate: every duration and every step stays what it was."""
    t = made("long")
    other = resampled(t, rate)
    assert len(strikes(other.phase, other.tick)) == len(strikes(t.phase, t.tick)) >= 4
    for (row, leg), (there, same) in zip(strikes(t.phase, t.tick), strikes(other.phase, other.tick), strict=True):
        assert leg == same
        assert there * other.tick == pytest.approx(row * t.tick, abs=2.1e-3)
    one, two = measure(t, (1.0, 5.0)), measure(other, (1.0, 5.0))
    for name in ("steps", "alternation"):
        assert two[name] == one[name], name
    assert walked(one, 5.0, t.robot.walked)
    assert walked(two, 5.0, t.robot.walked)
    for name in ("step_length", "step_frequency", "speed", "clearance", "double_support", "cost_of_transport"):
        assert two[name] == pytest.approx(one[name], rel=0.02), name


def test_bounces_and_swings_are_told_apart_by_seconds():
    """A foot 40 ms in the air has bounced, one of 60 ms stepped; a swing of 90 ms has no clearance, one of 110 has."""
    for rate in (500, 1000, 2000, 4000):
        for ms, stepped in ((40, 0), (60, 1)):
            phase = np.ones((rate, 2))
            phase[rate // 10 : rate // 10 + ms * rate // 1000, 0] = 3
            assert len(strikes(phase, 1.0 / rate)) == stepped, (rate, ms)
        for ms, cleared in ((90, False), (110, True)):
            phase = np.ones((1000, 2))
            phase[100 : 100 + ms, 0] = 3
            t = resampled(borne(synthetic(1.0, q=[0.0, 1.3, *[0.0] * 7], phase=phase)), rate)
            assert math.isfinite(measure(t, (0.0, 1.0))["clearance"]) == cleared, (rate, ms)


def resampled(t: Trajectory, rate: float) -> Trajectory:
    """The run with its rows at another rate [Hz]: every second one, or each twice."""
    if rate * t.tick < 1.0:
        step = round(1.0 / (rate * t.tick))
        return replace(t, log=t.log[::step].copy(), tick=t.tick * step, sampled=True)
    times = round(rate * t.tick)
    log = np.repeat(t.log, times, axis=0)
    log[:, 0] += np.tile(np.arange(times) * t.tick / times, len(t))
    return replace(t, log=log, tick=t.tick / times)
