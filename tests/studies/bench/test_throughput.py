"""The price list: bare steps are those of the run, and what a scene does not use it does not load."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from biped.cli.main import main
from biped.engines import home
from biped.engines import mujoco as general
from biped.engines.native import native
from biped.engines.planar.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.robot.planar.build import compile_foreign
from biped.scenario.keys import Scenario, Simulation, Start
from biped.scenario.reading import read_scenario
from biped.scenario.world import Push
from biped.show.replay import record_runs
from biped.studies.bench import scenes
from biped.studies.bench.features import BASE, FEATURES, prices
from biped.studies.bench.parts import STRIDE, _states, _touch, contact_costs
from biped.studies.bench.replay import replay_of, replayed, steps
from biped.studies.bench.scenes import MECHANICS, ROBOTS, SCENES, scene_cost

SECONDS = 0.1


@pytest.fixture(scope="module")
def walked():
    run = Plan(Scenario(duration=1.5, controller="normal", start=Start(posture="heel_toe"))).run(0)
    return run, simulate(run)


def test_states_of_the_home_engines_bench_move_as_the_run_did():
    """Accelerations at a run's states, forces and contacts are those that its next velocities show."""
    run = Plan(Scenario(engine="home", duration=0.5, start=Start(posture="heel_toe"))).run(0)
    t = home.simulate(run)
    records = _states(run, t)
    _touch(records)
    at = np.arange(1, len(t), STRIDE)
    inside = at < len(t) - 1
    touching = np.hstack([t.force[..., 2] > 0.0, t.stop != 0.0])
    steady = inside & np.array([(touching[max(k - 1, 0) : k + 3] == touching[k]).all() for k in at])
    assert steady.sum() > 10
    theirs = (t.v[at[steady] + 1] - t.v[at[steady]]) / t.tick
    np.testing.assert_allclose(records["motion"]["v_dot"][steady], theirs, atol=0.05 * np.abs(theirs).max())


def test_bare_steps_in_compiled_code_are_the_same_steps(walked):
    """Torques of the run through bare steps end where the run ended, from Python and compiled."""
    run, trajectory = walked
    ends = []
    for compiled in (False, True):
        foreign = compile_foreign(run.model, run.scenario)
        data = mujoco.MjData(foreign.model)
        data.qpos[:], data.qvel[:] = run.q, run.v
        given = np.ascontiguousarray(trajectory.u[:-1])
        if compiled:
            found = native(foreign.model, foreign.order)
            assert found is not None
            steps(found.step, foreign.model._address, data._address, data.ctrl, given, 1)
        else:
            for u in given:
                data.ctrl[:] = u
                mujoco.mj_step(foreign.model, data)
        ends.append(np.array(data.qpos))
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[0], trajectory.q[-1])


def test_a_step_with_more_contacts_is_told_apart(walked):
    assert len(contact_costs(*walked)) >= 2


# What each feature needs of biped's own and of other packages; nothing else may load it.
NEEDS = {
    "sensor noise": ("biped.control.planar.senses",),
    "torque limit by OSQP": ("qpsolvers", "osqp"),
    "home engine": ("biped.engines.home", "biped.engines.rigid.events"),
    "recording": ("biped.show.recording", "rerun"),
}


@pytest.fixture(scope="module")
def priced():
    return prices(
        ("plain", "ground that only pushes", "Q_d itself", "push", "actuator lag", *NEEDS), SECONDS, record_runs
    )


@pytest.mark.parametrize("feature", ["ground that only pushes", "Q_d itself", "push", "actuator lag", *NEEDS])
def test_only_scenes_with_a_feature_load_it(priced, feature):
    own = priced[feature]["only_imported"]
    assert set(NEEDS.get(feature, ())) <= set(own)
    for other, needed in NEEDS.items():
        if other != feature:
            assert not set(needed) & set(own), f"{feature} loads what only {other} needs"


def test_a_scene_without_the_home_engine_compiles_no_kernel_of_it(priced):
    assert not [name for name in priced["plain"]["kernels"] if name.startswith("engines.rigid.")]
    assert [name for name in priced["home engine"]["only_kernels"] if name.startswith("engines.rigid.")]


def test_a_scene_is_priced_by_the_tick_and_says_how_it_is_looped_over(walked, monkeypatch):
    """On a clock that goes on by what is done: 3 µs a tick of a run, 2 of bare steps and handing over, 1 of handing."""
    run, trajectory = walked
    ticks, spent = len(trajectory), [0.0]

    def taking(work, price):
        def done(*arguments):
            spent[0] += 1e-6 * ticks * price(*arguments)
            return work(*arguments)

        return done

    def clock(work):
        before = spent[0]
        work()
        return spent[0] - before

    monkeypatch.setattr(scenes, "clock", clock)
    monkeypatch.setattr(scenes, "simulate", taking(simulate, lambda run: 3.0))
    monkeypatch.setattr(scenes, "measure", taking(measure, lambda *_: 0.5))
    monkeypatch.setattr(scenes, "replayed", taking(replayed, lambda replay, step=True: 2.0 if step else 1.0))
    monkeypatch.setattr(scenes, "strict", lambda *_: 0.5e-6 * ticks)
    cost = scene_cost(run, 1)
    assert (cost.loop, cost.end, cost.ticks) == ("compiled", trajectory.end, ticks)
    assert cost[3:] == pytest.approx((1.0, 0.5, 3.0, 0.5, 3.5, 7.0))


def test_bare_steps_are_pushed_and_divided_as_those_of_the_run():
    """The same run again, without its controller, ends in the same place."""
    push = Push(at=0.05, duration=0.1, force=(150.0, 40.0), body="left_shank")
    run = Plan(Scenario(duration=0.3, start=Start(posture="heel_toe"), push=(push,),
                        simulation=Simulation(timestep=5e-4))).run(0)  # fmt: skip
    trajectory = simulate(run)
    before = replace(trajectory, log=trajectory.log[:-1])
    np.testing.assert_array_equal(replayed(replay_of(run, before)).qpos, trajectory.q[-1])


@pytest.mark.parametrize("name", ["any/human", "any/walker2d"])
def test_bare_steps_of_robots_of_any_kind_are_those_of_the_run(name):
    """Pushed, and with what its law commanded, the run without its law ends in the same place."""
    run = Plan(read_scenario(name, ["duration=1.4"])).run(1)
    trajectory = general.simulate(run)
    replay = replay_of(run, trajectory)
    assert len(replay.spans) > 1
    before = replay._replace(
        commanded=replay.commanded[: len(trajectory) - 1],
        spans=[(first, min(last, len(trajectory) - 1), pushed) for first, last, pushed in replay.spans],
    )
    data = replayed(before)
    np.testing.assert_array_equal(data.qpos, trajectory.q[-1])


def test_a_run_of_a_robot_of_any_kind_costs_more_than_its_steps():
    run = Plan(read_scenario("any/walker2d", ["duration=1.3"])).run(0)
    cost = scene_cost(run, 1)
    assert cost.loop == "in Python"
    assert cost.ticks == 1300
    assert cost.closed_loop > cost.physics >= cost.steps > 0.0
    assert cost.strict >= cost.with_metrics > 1.0


def test_runs_of_robots_of_any_kind_are_of_such_robots():
    for name, *changes in ROBOTS.values():
        assert Plan(read_scenario(name, changes)).scenario.robot is not None


def test_every_scene_is_valid_and_in_mujoco():
    for name, *changes in (*SCENES.values(), *MECHANICS.values()):
        assert Plan(read_scenario(name, changes)).scenario.engine == "mujoco"


def test_every_feature_is_a_valid_scene():
    for changes in FEATURES.values():
        Plan(read_scenario(BASE, list(changes)))


def test_a_robot_of_ones_own_is_timed_at_the_rate_that_is_asked_for(monkeypatch, capsys):
    timed = []
    cost = scenes.SceneCost("compiled", "completed", 1, 2.0, 1.0, 3.0, 1.0, 2.0, 4.0)
    monkeypatch.setattr(scenes, "scene_cost", lambda run, repeats: timed.append(run.scenario) or cost)
    given = ["model=h1", "controller=any/apollo", "simulation.control_rate=1000", "simulation.timestep=0.001"]
    assert main(["bench", "mechanics", *(word for change in given for word in ("--set", change))]) == 0
    assert [s.control.mechanics for s in timed] == ["compiled", "engine", "pinocchio"]
    assert {(s.simulation.control_rate, s.controller) for s in timed} == {(1000.0, "any/apollo")}
    assert "1.5" in capsys.readouterr().out, "closed loop / physics"


def test_changes_of_what_takes_none_are_refused(capsys):
    assert main(["bench", "walking", "--set", "duration=1"]) == 2
    assert "--set: expected none for walking; mechanics takes it" in capsys.readouterr().err
