"""What a push is worth and how a walk comes back, on walks whose steps are made up."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from biped.measure.metrics import measure
from biped.measure.metrics.pushed import impulses, pushed
from biped.measure.pushes import pushes_of
from biped.measure.trajectory import Trajectory
from biped.robot.planar.tree import motion
from biped.scenario.keys import Scenario
from biped.scenario.metrics import METRICS
from biped.scenario.pushing import pieces
from biped.scenario.world import Push
from tests.measure.made_up import lifted, standing
from tests.runs import made, synthetic

STEP = 0.5


def walk(speeds: list[float], pushes: tuple[tuple, ...]) -> Trajectory:
    """Steps of half a second, each at its own speed; feet come down in turn at the end of each."""
    ticks = round(STEP * 1000)
    v = np.repeat(speeds, ticks)
    swings = [(i * ticks + 100, (i + 1) * ticks, i % 2) for i in range(len(speeds))]
    q = np.zeros((len(v), 9))
    q[:, 0] = np.concatenate([[0.0], np.cumsum(v)[:-1]]) * 1e-3
    q[:, 1] = 1.0
    t = standing(synthetic(len(v) * 1e-3, q=q), lifted(len(v), *swings))
    return replace(t, pushes=pushes, end="completed")


def numbers(t: Trajectory) -> dict[str, float]:
    return pushed(t)


def test_an_impulse_in_the_fields_units():
    t = walk([1.0] * 12, ((3.1, 3.3, 200.0, 0.0, "torso"),))
    found = numbers(t)
    assert found["push_impulse"] == pytest.approx(40.0)  # the thesis's
    assert found["push_speed"] == pytest.approx(40.0 / 75.0)
    assert found["push_froude"] == pytest.approx(40.0 / (75.0 * math.sqrt(9.81 * t.tree.leg)))
    assert found["recovery_time"] == 0.0


@pytest.mark.parametrize(
    ("pushes", "expected"),
    [
        (((1.0, 1.2, -200.0, 0.0, "torso"),), [-40.0]),
        (((1.0, 1.2, 30.0, 40.0, "torso"),), [10.0]),
        (((1.0, 1.2, 0.0, -50.0, "torso"),), [-10.0]),
        (((1.0, 1.1, 100.0, 0.0, "torso"), (1.1, 1.3, 200.0, 0.0, "torso")), [50.0]),
        (((2.0, 2.1, 100.0, 0.0, "torso"), (1.0, 1.1, 50.0, 0.0, "left_foot")), [5.0, 10.0]),
        (((5.9, 6.5, 100.0, 0.0, "torso"),), [10.0]),  # the run ends at 6 s
        (((7.0, 7.5, 100.0, 0.0, "torso"),), []),
    ],
)
def test_pushes_that_touch_are_one(pushes, expected):
    found = impulses(walk([1.0] * 12, pushes))
    assert [push.size for push in found] == pytest.approx(expected)


def shaped(**keys) -> tuple[tuple, ...]:
    push = Push(**{"at": 1.0, "duration": 2.0, "force": (60.0, 0.0)} | keys)
    return tuple((p.start, p.end, *p.force, p.body) for p in pieces(Scenario(push=(push,))))


def test_every_half_wave_of_a_sine_is_a_push():
    found = impulses(walk([1.0] * 12, shaped(shape="sine", frequency=1.0)))
    assert [push.size for push in found] == pytest.approx([60.0 / math.pi, -60.0 / math.pi] * 2)
    assert [push.start for push in found] == pytest.approx([1.0, 1.5, 2.0, 2.5])
    assert numbers(walk([1.0] * 12, shaped(shape="sine", frequency=1.0)))["push_impulse"] == pytest.approx(60 / math.pi)


def test_a_ramp_is_one_push():
    found = impulses(walk([1.0] * 12, shaped(shape="ramp")))
    assert [(push.size, push.start, push.end) for push in found] == [pytest.approx((60.0, 1.0, 3.0))]


def test_recovery_counts_from_the_end_of_a_sine():
    t = walk([1.0] * 6 + [1.3, 1.2, 1.3, 1.0, 1.0, 1.0, 1.0], shaped(at=3.1, duration=1.0, shape="sine"))
    assert numbers(t)["recovery_time"] == pytest.approx(4.5 - 4.1, abs=2e-3)


def test_people_see_one_push_where_pieces_belong_together():
    held = ((5.0, 5.2, 30.0, 0.0, "torso"), (5.2, 5.4, 10.0, 5.0, "torso"))
    t = walk([1.0] * 12, (*shaped(shape="sine", frequency=2.0), *held))
    sine, first, second = pushes_of(t)
    assert (sine.start, sine.end, sine.size) == (1.0, pytest.approx(3.0), "changing, up to 60 N")
    assert (first.size, second.size) == ("+30 N", "+10 N, +5 N up")
    assert len(sine.force) == len(sine.time) - 1 == 200


def test_recovery_ends_where_steps_are_as_before():
    push = ((3.1, 3.3, 200.0, 0.0, "torso"),)
    off = walk([1.0] * 6 + [1.0, 1.6, 1.3, 1.0, 1.0, 1.0, 1.0], push)
    assert numbers(off)["recovery_time"] == pytest.approx(4.5 - 3.3, abs=2e-3)
    # a step that is off again later counts too
    again = walk([1.0] * 6 + [1.0, 1.6, 1.0, 1.0, 0.8, 1.0, 1.0, 1.0], push)
    assert numbers(again)["recovery_time"] == pytest.approx(5.5 - 3.3, abs=2e-3)
    # the step of the push itself
    during = walk([1.0] * 6 + [1.5] + [1.0] * 6, push)
    assert numbers(during)["recovery_time"] == pytest.approx(3.5 - 3.3, abs=2e-3)


def test_there_is_no_recovery_time_where_there_is_none():
    push = ((3.1, 3.3, 200.0, 0.0, "torso"),)
    never = walk([1.0] * 7 + [1.6] * 6, push)
    assert math.isnan(numbers(never)["recovery_time"])
    late = walk([1.0] * 12, ((5.2, 5.3, 200.0, 0.0, "torso"),))
    assert math.isnan(numbers(late)["recovery_time"])
    early = walk([1.0] * 12, ((0.5, 0.6, 200.0, 0.0, "torso"),))
    assert math.isnan(numbers(early)["recovery_time"])
    assert math.isnan(numbers(replace(never, end="fell"))["recovery_time"])


def test_the_scatter_of_steps_before_widens_the_band():
    push = ((4.1, 4.3, 200.0, 0.0, "torso"),)
    rough = [1.2, 0.8] * 4 + [1.0, 1.25, 0.8, 1.2, 0.8]
    assert numbers(walk(rough, push))["recovery_time"] == 0.0
    calm = [1.0] * 8 + [1.0, 1.25, 1.0, 1.0, 1.0]
    assert numbers(walk(calm, push))["recovery_time"] > 0.5


def test_the_steps_after_a_push_are_those_that_end_after_it():
    t = made("pushed")
    found = numbers(t)
    whole = motion(t.tree, t.q, t.v)
    names = [name for name in ("first_step", "second_step", "third_step", "fourth_step") if name in found]
    heels = np.abs(whole.point[:, 1, 0] - whole.point[:, 3, 0])
    for name in names:
        assert found[name] in heels[t.time >= 0.6 - 1e-9]


def test_runs_that_nobody_pushes_have_none_of_it():
    found = measure(made("walk"), (0.5, 2.0))
    for name in ("push_impulse", "push_speed", "push_froude", "recovery_time", "first_step", "fourth_step"):
        assert math.isnan(found[name])
        assert name in METRICS
