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
from biped.measure.metrics import NAMES, aggregate, measure
from biped.measure.metrics.energy import energy, residual
from biped.measure.metrics.gait import commonest_cycle, strikes
from biped.measure.metrics.ground import centre_of_pressure
from biped.robot.model import compile_foreign
from biped.robot.tree import motion
from biped.scenario.keys import Actuation, Ground, Scenario, Simulation, Start, Truth
from tests.control.bench import HUMAN
from tests.runs import SCENARIOS, made, mirrored, synthetic, tree

WEIGHT = 75.0 * 9.81


def test_every_name_is_measured():
    numbers = measure(made("walk"), (0.5, 2.0))
    assert set(NAMES) <= set(numbers)
    assert all(math.isfinite(numbers[name]) for name in NAMES)


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
    for key in NAMES:
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
    assert numbers["walked"] == 1
    assert numbers["falls"] == 0


def test_walking_is_more_than_standing_or_falling():
    still = synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7])
    stood = measure(still, (1.0, 2.0))
    assert stood["walked"] == 0
    assert math.isnan(stood["cost_of_transport"])
    fell = measure(replace(steady(), end="fell", cause="fell forward at 1.999 s"), (1.0, 2.0))
    assert (fell["walked"], fell["falls"]) == (0, 1)


def test_standing_is_more_than_staying_up():
    still = synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7])
    assert measure(still, (1.0, 2.0))["stood"] == 1
    assert measure(replace(still, end="fell", cause="fell forward at 1.999 s"), (1.0, 2.0))["stood"] == 0
    assert measure(steady(), (1.0, 2.0))["stood"] == 0
    swaying = synthetic(2.0, q=np.outer(0.11 * np.sin(np.pi * np.arange(2000) / 500), np.eye(9)[0]))
    assert measure(swaying, (0.0, 2.0))["stood"] == 0
    stepping = synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7], phase=np.outer(1 + 2 * (np.arange(2000) % 500 > 250), [1, 0]))
    assert measure(stepping, (0.0, 2.0))["stood"] == 0


def test_a_run_that_ended_before_the_window_has_no_means():
    early = replace(steady(), end="fell", cause="x")
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
    assert strikes(phase) == [(300, 0), (600, 1)]


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
    walker = dict.fromkeys(NAMES, 1.0) | {"falls": 0, "walked": 1, "stood": 0}
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
