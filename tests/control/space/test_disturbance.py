"""What the law takes for a push: what speeds the walker up to a side, and neither gravity nor its own forces do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.control.space.disturbance import NOTICED, notice_push
from biped.control.space.pushing import EDGES
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from tests.control.space.scene import Scene

TICK = 1e-3


def noticed(scene: Scene, acceleration: np.ndarray, force: np.ndarray, heading: float = 0.0, ticks: int = 200) -> float:
    """What is noticed of a walker that speeds up so [m/s²], while the law expects so much force of the ground [N]."""
    c, mu = scene.c, scene.c["actuation"]["friction"]
    c["gait"]["heading"] = heading
    c["tick"]["force"][:] = 0.0
    for k, part in ((0, force[0]), (2, force[1])):  # at the second point, by the edge that leans that way
        c["tick"]["force"][EDGES + k + (part < 0.0)] = abs(part) / mu
    c["memory"]["pushed"] = 0.0
    for tick in range(ticks):
        c["at"]["com_velocity"][:2] = tick * TICK * acceleration
        notice_push(c, tick == 0)
    return float(c["memory"]["pushed"])


@pytest.mark.parametrize("heading", [0.0, 0.6, -2.0])
def test_it_is_what_the_laws_forces_do_not_explain_to_the_left_of_its_heading(heading):
    scene = Scene()
    left = np.array([-math.sin(heading), math.cos(heading)])
    push, force = np.array([0.5, 2.0]), np.array([-90.0, 140.0])
    mass = float(scene.model.body_mass.sum())
    assert noticed(scene, force / mass, force, heading) == pytest.approx(0.0, abs=1e-9)
    assert noticed(scene, force / mass + push, force, heading) == pytest.approx(push @ left, rel=1e-5)
    first = 1.0 - math.exp(-TICK / NOTICED)
    assert noticed(scene, push, 0.0 * force, heading, ticks=2) == pytest.approx(first * push @ left, rel=1e-9)


def test_gravity_along_the_ground_is_no_push():
    scene = Scene("ground.slope=4.0", "ground.side_slope=-3.0")
    down = np.array(scene.model.opt.gravity[:2])
    assert abs(down[1]) > 0.4
    assert noticed(scene, down, np.zeros(2)) == pytest.approx(0.0, abs=1e-9)


def test_an_impact_counts_as_no_more_than_the_weight():
    share = 1.0 - math.exp(-TICK / NOTICED)
    assert noticed(Scene(), np.array([0.0, 500.0]), np.zeros(2), ticks=2) == pytest.approx(share * 9.81)


LITTLE = 1e-9
"""[rad s²/m] Of placement, so that the walk stays as it is without."""


def counted(*changes: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], and what is noticed of a push by the placement of the right and the left leg [m/s²]."""
    walks = []
    for push in (LITTLE, 0.0):
        more = [f"gains.frontal.placement.push={push}", "start.jitter=0.0", "duration=0.4", "controller=human3d_whole"]
        walks.append(simulate(Plan(read_scenario("spatial/own", [*more, *changes])).run(0)))
    one, other = walks
    right, left = ((one.signals[name] - other.signals[name])[:-1] / LITTLE for name in ("right_placed", "left_placed"))
    return one.time[:-1], right, left


@pytest.mark.parametrize("force", [-200.0, 200.0])
def test_a_push_is_noticed_while_it_lasts_and_counts_on_the_side_of_the_leg_that_swings(force):
    """It is the right one, from 0.1 to 0.58 s."""
    time, right, left = counted(f"push=[{{at=0.25,duration=0.1,force=[0.0,{force},0.0]}}]")
    before, during, after = time < 0.249, (time > 0.29) & (time < 0.34), time > 0.38
    assert np.abs(right[before]).max() < 0.5, "nobody pushes it"
    if force < 0.0:  # to the right
        assert right[during].mean() == pytest.approx(200.0 / 75.0, rel=0.2)
        assert right[after].max() < 0.5 * right[during].mean()
    else:
        assert np.abs(right[during]).max() < 0.2
    assert not left.any()


def test_where_q_d_itself_acts_there_are_no_forces_of_the_law_and_nothing_is_noticed():
    _, right, left = counted("actuation.mode=generalized", "push=[{at=0.2,duration=0.1,force=[0.0,-99.0,0.0]}]")
    assert not right.any()
    assert not left.any()
