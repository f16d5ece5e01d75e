"""Starts in the middle of a walk: whose state it is, how it is set down on a slope, and who falls before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from biped.base.errors import InputError
from biped.ensemble import midwalk
from biped.ensemble.campaign import simulate
from biped.ensemble.midwalk import TRIES, begun_walking
from biped.ensemble.plan import Plan
from biped.robot.load import starts_of
from biped.robot.parts import contact_points
from biped.robot.run import Run
from biped.scenario.reading import read_scenario

WALKING = ("duration=0.1", "start.walking=0.4", "start.posture=heel_toe")


def run_of(*changes: str) -> Run:
    return Plan(read_scenario("spatial/own", [*WALKING, *changes])).run(0)


def soles(run: Run, q: np.ndarray) -> np.ndarray:
    """(2,) [m] the lowest point of each sole."""
    import mujoco

    starts = starts_of(run.model, run.robot, run.scenario.robot)
    data = mujoco.MjData(starts.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(starts.model, data)
    return contact_points(data, run.robot)[:, 2].reshape(2, -1).min(axis=1)


def test_it_begins_in_a_state_of_the_level_walk_on_one_foot():
    walks = []

    def noted(run: Run):
        walks.append(simulate(run))
        return walks[-1]

    push = "push=[{at=0.0,duration=0.4,force=[300.0,0.0,0.0]}]"
    run = run_of(push)
    begun = begun_walking(run, noted)
    (walk,) = walks
    (row,) = np.flatnonzero((walk.v == begun.v).all(axis=1))
    assert row * run.tick >= 0.4
    np.testing.assert_array_equal(begun.q[3:], walk.q[row][3:])
    assert (begun.q[:2] == 0.0).all()
    low = np.sort(soles(run, begun.q))
    assert low[0] == pytest.approx(0.0, abs=1e-12)
    assert low[1] > 0.005
    assert begun_walking(run, simulate).v.tobytes() == begun.v.tobytes(), "the same run begins in the same state"
    np.testing.assert_array_equal(simulate(run).q[0], begun.q)


def test_the_walk_before_knows_no_push_and_no_slope():
    plain = begun_walking(run_of(), simulate)
    pushed = begun_walking(run_of("push=[{at=0.0,duration=0.4,force=[300.0,0.0,0.0]}]"), simulate)
    sloping = begun_walking(run_of("ground.slope=4.0"), simulate)
    np.testing.assert_array_equal(pushed.q, plain.q)
    np.testing.assert_array_equal(sloping.v, plain.v)


def test_on_a_slope_the_body_stays_upright():
    plain = begun_walking(run_of(), simulate)
    sloping = begun_walking(run_of("ground.slope=4.0", "start.upright=true"), simulate)
    turned = 2.0 * np.degrees(np.arccos(min(1.0, abs(plain.q[3:7] @ sloping.q[3:7]))))
    assert turned == pytest.approx(4.0, abs=1e-3)
    assert soles(sloping, sloping.q).min() == pytest.approx(0.0, abs=1e-12)


def test_runs_take_their_walks_over_at_different_moments():
    plan = Plan(read_scenario("spatial/own", [*WALKING, "randomise.runs=4", "start.jitter=0.0"]))
    states = {begun_walking(plan.run(i), simulate).q.tobytes() for i in range(4)}
    assert len(states) == 4


@pytest.mark.parametrize(("jitter", "walks"), [(0.002, 1 + TRIES), (0.0, 1)])
def test_a_walk_that_falls_is_made_again_and_at_last_the_run_begins_in_its_posture(monkeypatch, jitter, walks):
    """Without deviations the walk would fall again: it is made once."""
    monkeypatch.setattr(midwalk, "WITHIN", 0.2)
    falling = "gains.k_d1=1.0", "gains.b_d1=0.0", f"start.jitter={jitter}", "start.upright=true", "ground.slope=3.0"
    starts = []

    def noted(one: Run):
        starts.append(one.q.tobytes())
        return simulate(one)

    begun = begun_walking(run_of("start.walking=5.0", *falling), noted)
    assert len(starts) == walks
    assert len(set(starts)) == walks, "each from other deviations"
    plain = run_of("start.walking=0.0", *falling)
    np.testing.assert_array_equal(begun.q, plain.q)
    np.testing.assert_array_equal(begun.v, plain.v)


def test_the_last_walk_that_is_made_again_counts(monkeypatch):
    """Five fall, the sixth does not."""
    count = 0

    def simulated(one: Run):
        nonlocal count
        count += 1
        short = replace(one, scenario=structs.replace(one.scenario, duration=0.05))
        return simulate(one if count == 1 + TRIES else short)

    begun = begun_walking(run_of("start.jitter=0.002"), simulated)
    assert count == 1 + TRIES
    plain = run_of("start.jitter=0.002", "start.walking=0.0")
    assert np.abs(begun.q - plain.q).max() > 0.05, "in the middle of a walk"


def test_in_the_plane_and_for_other_laws_it_is_refused():
    with pytest.raises(InputError, match=r"start\.walking: expected 0: model 'human' moves in the plane"):
        Plan(read_scenario("level_normal", ["start.walking=1.0"])).run(0)
    with pytest.raises(InputError, match=r"start\.walking: expected 0"):
        Plan(read_scenario("any/h1", ["start.walking=1.0"])).run(0)
