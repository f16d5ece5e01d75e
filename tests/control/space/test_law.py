"""The law in whole runs: compiled as asked tick by tick, mirrored if it begins so, refused where it is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from biped.base.errors import InputError
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario


def run_of(*changes: str, scenario: str = "spatial/own"):
    return Plan(read_scenario(scenario, ["start.jitter=0.0", *changes])).run(0)


PUSH = "push=[{at=0.05,duration=0.1,force=[30.0,80.0,0.0]}]"


@pytest.mark.parametrize("changes", [
    ["duration=0.4", PUSH],
    ["duration=0.3", "simulation.timestep=0.0005", "ground.slope=2.0", "ground.side_slope=1.5"],
    ["duration=0.4", PUSH, 'controller="human3d_generalized"'],
    ["duration=0.3", 'change=[{at=0.05,over=0.1,controller="human3d_stand"},{at=0.2,gains.axial.theta_b=9.0}]'],
])  # fmt: skip
def test_the_compiled_loop_is_the_one_in_python(changes):
    run = run_of(*changes)
    fast, slow = simulate(run), simulate(run, watch=lambda model, data, forces: None)
    assert len(fast) == len(slow)
    assert fast.end == slow.end == "completed"
    for name in fast.columns:
        a, b = fast.column(name), slow.column(name)
        assert np.abs(a - b).max() <= 1e-6 * max(1.0, np.abs(b).max()), name
    assert fast.signals.keys() == slow.signals.keys()
    for name in fast.signals:
        assert np.abs(fast.signals[name] - slow.signals[name]).max() < 1e-6, name


def mirrored(run):
    """The run with its start, and its pushes, seen in a mirror."""
    q, v = run.q.copy(), run.v.copy()
    q[[1, 4, 6]] *= -1.0
    q[7:] = np.concatenate([q[13:], q[7:13]])
    v[[1, 3, 5]] *= -1.0
    v[6:] = np.concatenate([v[12:], v[6:12]])
    return replace(run, q=q, v=v)


@pytest.mark.parametrize("controller", ["human3d", "human3d_generalized"])
def test_a_mirrored_start_gives_the_mirrored_walk(controller):
    run = run_of("duration=0.6", f'controller="{controller}"')
    one, other = simulate(run), simulate(mirrored(run))
    swapped = np.concatenate([other.q[:, 13:], other.q[:, 7:13]], axis=1)
    assert np.abs(one.q[:, 7:] - swapped).max() < 1e-6
    assert np.abs(one.q[:, 0] - other.q[:, 0]).max() < 1e-6
    assert np.abs(one.q[:, 1] + other.q[:, 1]).max() < 1e-6
    assert np.ptp(one.q[:, 1]) > 5e-3, "nothing moves sideways: the test would not see a wrong sign"


def test_it_walks():
    t = simulate(run_of("duration=3.0"))
    assert t.end == "completed"
    assert t.base[-1, 0] > 1.5
    gap = t.point[:, 4:, 1].mean(axis=1) - t.point[:, :4, 1].mean(axis=1)
    assert gap.min() > 0.075
    assert np.abs(t.u[:, [5, 11]]).max() <= 40.0 + 1e-9


def test_falls_are_told_in_the_compiled_loop_too():
    run = run_of("duration=3.0", "push=[{at=0.1,duration=0.3,force=[0.0,900.0,0.0]}]")
    fast, slow = simulate(run), simulate(run, watch=lambda model, data, forces: None)
    assert fast.end == slow.end == "fell"
    assert "left" in fast.cause
    assert abs(len(fast) - len(slow)) <= 5


@pytest.mark.parametrize(("changes", "words"), [
    (['actuation.contacts="released"'], "actuation.contacts"),
    (['controller="calm"'], "gains.frontal: missing"),
    (['model="human"'], "gains.frontal"),
])  # fmt: skip
def test_what_has_no_meaning_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        simulate(run_of(*changes))


def test_a_planar_model_refuses_tables_of_a_walker_in_space():
    with pytest.raises(InputError, match=r"gains\.frontal: expected none: model 'human' moves in the plane"):
        Plan(read_scenario("level_normal", ['controller="human3d"']))


def test_another_robot_is_refused_in_words():
    s = run_of().scenario
    assert s.robot is not None
    feet = tuple(structs.replace(foot, geoms=foot.geoms[:2]) for foot in s.robot.foot)
    other = Plan(structs.replace(s, robot=structs.replace(s.robot, foot=feet))).run(0)
    with pytest.raises(
        InputError, match="law: 'thesis' is not for model 'human3d': foot 'right' touches the ground along a line"
    ):
        simulate(other)
