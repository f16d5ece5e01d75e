"""The MuJoCo engine leaves behind what MuJoCo itself computes."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.description import description_at
from biped.scenario.keys import Scenario, Simulation, Start
from tests.runs import SCENARIOS, made
from tests.ticks import HUMAN


def again(name: str):
    """Every row of a run, set up afresh in MuJoCo with the forces that acted: (row, data)."""
    t, s = made(name), SCENARIOS[name]
    model = compile_foreign(HUMAN, s).model
    data = mujoco.MjData(model)
    angle = np.radians(s.ground.slope)
    for k in range(len(t)):
        data.qpos[:], data.qvel[:] = t.q[k], t.v[k]
        data.qfrc_applied[:] = t.applied[k]
        data.xfrc_applied[:] = 0.0
        for start, end, forward, up, body in t.pushes:
            if start - 1e-9 <= t.time[k] < end - 1e-9:
                data.xfrc_applied[model.body(body).id, 0] += forward * np.cos(angle) + up * np.sin(angle)
                data.xfrc_applied[model.body(body).id, 2] += up * np.cos(angle) - forward * np.sin(angle)
        mujoco.mj_forward(model, data)
        yield k, model, data


@pytest.mark.parametrize("name", ["walk", "slope", "slippery", "pushed", "generalized", "pyramidal", "folded"])
def test_logged_forces_are_all_of_mujocos_constraint_forces(name):
    """Jᵀ(ground forces) + knee stops = qfrc_constraint in all nine coordinates, at every row."""
    t = made(name)
    assert len(t) > 300
    touched = stopped = 0
    for k, model, data in again(name):
        total = np.zeros(9)
        total[[4, 7]] = t.stop[k]
        for i, point in enumerate(description_at(HUMAN).points):
            J = np.zeros((3, 9))
            # MuJoCo's contact lies half-way between the point and the ground above it.
            place = data.site(point).xpos * [1.0, 1.0, 0.5]
            mujoco.mj_jac(model, data, J, None, place, model.site(point).bodyid[0])
            total += t.column("force")[k, i] @ J[[0, 2]]
        np.testing.assert_allclose(
            total, data.qfrc_constraint, atol=1e-4 * max(1.0, np.abs(total).max()), err_msg=f"{k}"
        )
        touched, stopped = touched + (t.column("force")[k] != 0.0).any(), stopped + (t.stop[k] != 0.0).any()
    assert touched > 200 or name == "folded"
    assert stopped > 20 or name in ("pushed", "slippery")
    assert name != "folded" or t.stop.max() > 50.0, "a knee that is bent as far as it can be is pushed the other way"


@pytest.mark.parametrize("name", ["walk", "pushed", "generalized"])
def test_next_row_is_one_step_later(name):
    t = made(name)
    for k, _, data in again(name):
        if k + 1 < len(t):
            v = t.v[k] + 0.001 * data.qacc
            np.testing.assert_allclose(t.v[k + 1], v, atol=1e-5 * max(1.0, np.abs(v).max()))
            np.testing.assert_allclose(t.q[k + 1], t.q[k] + 0.001 * t.v[k + 1], atol=1e-12)


def test_several_steps_per_tick():
    """At half the time step a tick is two steps with the same torques."""
    t = made("substeps")
    assert t.tick == 0.001
    model = compile_foreign(HUMAN, SCENARIOS["substeps"]).model
    data = mujoco.MjData(model)
    for k in range(0, len(t) - 1, 50):
        data.qpos[:], data.qvel[:], data.ctrl[:] = t.q[k], t.v[k], t.u[k]
        mujoco.mj_step(model, data, 2)
        np.testing.assert_allclose(data.qpos, t.q[k + 1], atol=1e-9)


def test_same_run_same_bytes():
    run = Plan(SCENARIOS["walk"]).run(0)
    assert simulate(run).log.tobytes() == made("walk").log.tobytes()


def test_nothing_of_a_run_is_left_for_the_next():
    """Data of runs that have ended are used again, whatever those ended with."""
    plan = Plan(Scenario(duration=0.3))
    run = plan.run(0)
    first = simulate(run).log.tobytes()
    spare = compile_foreign(run.model, run.scenario).spare
    assert len(spare) == 1
    (data,) = spare
    data.qpos[:], data.qvel[:], data.xfrc_applied[:], data.qfrc_applied[:], data.ctrl[:] = 9.0, 1e11, 1e4, 1e4, 1e3
    data.qacc_warmstart[:], data.time = 1e5, 77.0
    mujoco.mj_step(data.model, data)
    assert data.warning.number.any()
    again = simulate(run)
    assert spare == [data]
    assert again.log.tobytes() == first
    assert not again.warnings


def test_a_mirrored_start_walks_mirrored():
    """Neither controller nor engine knows right from left (to rounding, while it has not grown)."""
    s = Scenario(duration=0.3, start=Start(posture="single"))
    run = Plan(s).run(0)
    order = [0, 1, 2, 6, 7, 8, 3, 4, 5]
    one, two = simulate(run), simulate(replace(run, q=run.q[order], v=run.v[order]))
    np.testing.assert_allclose(two.q[:, order], one.q, atol=1e-7)


def test_falls_end_the_run_and_are_named():
    weak = replace_torque(Scenario(duration=3.0, start=Start(posture="single")), 5.0)
    t = simulate(Plan(weak).run(0))
    assert t.end == "fell"
    assert t.cause.endswith(f"at {t.time[-1]:.3f} s")
    assert t.cause.split(" at ")[0] in ("collapsed", "fell forward", "fell backward")
    assert len(t) < 3000


def replace_torque(s: Scenario, limit: float) -> Scenario:
    import msgspec

    return msgspec.structs.replace(s, actuation=msgspec.structs.replace(s.actuation, torque_limit=limit))


def test_divergence_is_noticed_in_the_tick_it_happens(tmp_path, monkeypatch):
    """A run whose numbers stop being finite says so; MuJoCo neither resets it nor writes a log file."""
    monkeypatch.chdir(tmp_path)
    wild = Scenario(duration=1.0, start=Start(posture="flat", v=(0.0, 0.0, *[1e155] * 7)), simulation=Simulation())
    t = simulate(Plan(wild).run(0))
    assert t.end == "diverged"
    assert "stopped being finite" in t.cause
    assert len(t) < 10
    assert not list(tmp_path.iterdir())


def test_engine_warnings_are_reported():
    quiet = made("walk")
    assert quiet.warnings == {}
    assert replace(quiet, warnings={"badqacc": 1}).warnings
