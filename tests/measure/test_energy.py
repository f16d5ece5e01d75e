"""Energy: accounted for, and what transport costs of it."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from biped.engines.planar.mujoco import simulate
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.planar.build import compile_foreign
from biped.robot.robot import with_tree
from biped.scenario.devices import Actuation
from biped.scenario.keys import Scenario, Simulation, Start, Truth
from biped.scenario.world import Ground
from biped.studies.run import plan_of
from tests.measure.made_up import WEIGHT
from tests.runs import made, synthetic
from tests.ticks import HUMAN


def residual(t: Trajectory) -> float:
    return measure(t, (0.0, t.time[-1]))["energy_residual"]


def test_energy_is_mujocos():
    for slope in (0.0, 4.0):
        model = compile_foreign(HUMAN, Scenario(ground=Ground(slope=slope))).model
        model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        data = mujoco.MjData(model)
        rng = np.random.default_rng(0)
        for _ in range(10):
            data.qpos[:], data.qvel[:] = rng.normal(size=9), rng.normal(size=9)
            mujoco.mj_forward(model, data)
            t = replace(synthetic(0.001, q=data.qpos, v=data.qvel), slope=slope, gravity=())
            assert t.energy[0] == pytest.approx(data.energy.sum(), abs=1e-9)


@pytest.mark.parametrize("name", ["walk", "slope", "slippery", "pushed", "generalized", "pyramidal", "folded"])
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
    steps = slice(500, 1999)
    power = t.u[steps] * (t.v[500:1999, 3:] + t.v[501:2000, 3:]) / 2.0
    work = WEIGHT * abs(t.q[1999, 0] - t.q[500, 0])
    numbers = measure(t, (0.5, 2.0))
    assert numbers["cost_of_transport"] == pytest.approx(0.001 * sum(abs(p.sum()) for p in power) / work)
    assert numbers["cost_of_transport_absolute"] == pytest.approx(0.001 * np.abs(power).sum() / work)
    assert numbers["cost_of_transport_positive"] == pytest.approx(0.001 * power[power > 0].sum() / work)
    assert numbers["peak_power"] == pytest.approx(np.abs(t.u[rows] * t.v[rows, 3:]).max())
    assert numbers["mean_torque"] == pytest.approx(np.abs(t.u[rows]).mean())
    assert numbers["per_joint"]["knee"]["peak_torque"] == pytest.approx(np.abs(t.u[rows][:, [1, 4]]).max())


def test_the_cost_is_that_of_the_work_done_where_torques_switch():
    """With physics much finer than the tick, the work of a torque that is held is it times how far its joint turns."""
    changes = ["simulation.timestep=5e-5", "duration=4", "window.start=1", "window.end=4"]
    t = campaign.simulate(plan_of("level_fast", changes).run(0))
    steps, weight = slice(1000, 3999), WEIGHT * abs(t.q[3999, 0] - t.q[1000, 0])
    turned = np.diff(t.q[1000:4000, 3:], axis=0)
    done = np.abs((t.u[steps] * turned).sum(axis=1)).sum() / weight
    before = 0.001 * np.abs((t.u[steps] * t.v[steps, 3:]).sum(axis=1)).sum() / weight
    assert measure(t, (1.0, 4.0))["cost_of_transport"] == pytest.approx(done, rel=0.01)
    assert before < 0.97 * done  # the rates at the beginning of a tick are not those within it


@pytest.mark.parametrize(("name", "force"), [("spatial/gentle", [0.0, 400.0, 0.0]), ("gentle/level", [600.0, 0.0])])
def test_torques_of_a_run_that_falls_jump_no_further_than_the_law_lets_them(name, force):
    """In space the row of a fall has no torques: the change to nothing is none of the law's."""
    changes = [f"push=[{{at=1.0,duration=0.2,force={force}}}]", "duration=4", "actuation.pushing.slew=10000.0"]
    t = campaign.simulate(plan_of(name, changes).run(0))
    assert t.end == "fell"
    assert measure(t, (0.5, 4.0))["torque_jump"] == pytest.approx(10.0)


def test_generalized_power_is_that_of_the_springs():
    """Q_d's power is the power of the seven spring-dampers: what flows into the joint coordinates, no more."""
    t = made("generalized")
    total = (t.Q_d[500:999] * (t.v[500:999] + t.v[501:1000]) / 2.0).sum(axis=1)
    work = WEIGHT * abs(t.q[999, 0] - t.q[500, 0])
    numbers = measure(t, (0.5, 1.0))
    assert numbers["cost_of_transport"] == pytest.approx(0.001 * np.abs(total).sum() / work)


@pytest.mark.parametrize("engine", ["mujoco", "home"])
def test_damped_joints_are_accounted_for(engine):
    walk = Scenario(
        duration=1.5, engine=engine, start=Start(posture="heel_toe"), actuation=Actuation(mode="generalized"),
        truth=Truth(joint_damping=2.0),
    )  # fmt: skip
    t = campaign.simulate(Plan(walk).run(0))
    assert residual(t) < 5e-3
    undamped = replace(t, robot=with_tree(t.robot, t.tree._replace(damping=np.zeros(6))))
    assert residual(undamped) > 10.0 * residual(t)
