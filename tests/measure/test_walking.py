"""What counts as walking, and what as standing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from biped.measure.metrics import assess
from biped.measure.metrics.walking import LEANING, LOW, PULL, SLIP, SUNK, outcome, outcome_of
from biped.measure.trajectory import Trajectory
from biped.measure.verdict import SOUND
from tests.measure.made_up import WEIGHT, borne, lifted, standing, steady
from tests.runs import synthetic

STEPS = ((1600, 1800, 0), (2000, 2200, 1), (2400, 2600, 0))
"""Swings: first row, row of the strike, foot."""


def measure(t: Trajectory, window: tuple[float, float], **others: float) -> dict:
    """Numbers of a run that nobody simulated, and its outcome as if they were sound: no law moves legs like that.

    Its feet slide below it, as no walk's do: what is asked of others is theirs.
    """
    numbers = assess(t, window).numbers | {"slip": 0.05, "verdict": SOUND, "doubt": ""} | others
    return numbers | outcome_of(t, numbers, SOUND, window[1] - window[0])


def walking(swings=STEPS) -> Trajectory:
    """Three seconds at 0.5 m/s with a step of the right leg, then of the left, then of the right."""
    q, v = np.zeros((3000, 9)), np.zeros((3000, 9))
    q[:, 0], q[:, 1], v[:, 0] = 0.5 * np.arange(3000) * 0.001, 1.3, 0.5
    return standing(synthetic(3.0, q=q, v=v), lifted(3000, *swings))


def test_a_walk_is_steps_on_the_ground():
    window = (1.5, 3.0)
    walk = measure(walking(), window)
    assert (walk["walked"], walk["stood"], walk["falls"], walk["doubtful"]) == (1, 0, 0, 0)
    assert walk["alternation"] == 1.0
    sliding = walking(())
    assert measure(sliding, window)["walked"] == 0, "no step at all"
    hopping = walking(STEPS[::2])
    assert measure(hopping, window)["walked"] == 0, "one leg only"
    flying = walking()
    flying.column("force")[1500:2000] = 0.0
    assert measure(flying, window)["walked"] == 0, "a third of the window in the air"
    carried = walking()
    carried.column("force")[:, :, 1] *= 0.7
    hung = measure(replace(carried, pushes=((0.0, 3.0, 0.0, 0.3 * WEIGHT, "torso"),)), window)
    assert hung["walked"] == 0, "carried by something else"
    slow = walking()
    slow.q[:, 0] *= 0.5
    assert measure(slow, window)["walked"] == 0


@pytest.mark.parametrize(
    ("share", "end", "mean"), [(0.2, 3.0, 0.2), (0.2, 2.25, 0.1), (-0.2, 3.0, -0.2), (0.2, 1.0, 0.0)]
)
def test_who_is_pulled_along_does_not_walk(share, end, mean):
    pulled = replace(walking(), pushes=((0.0, end, share * WEIGHT, 0.0, "torso"),))
    row = measure(pulled, (1.5, 3.0))
    assert row["pull"] == pytest.approx(mean, abs=1e-9)
    assert row["walked"] == (mean < PULL)


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
    assert measure(hovering, (1.0, 2.0))["stood"] == 0
    assert measure(replace(still, end="fell", cause="fell forward at 1.999 s"), (1.0, 2.0))["stood"] == 0
    assert measure(steady(), (1.0, 2.0))["stood"] == 0
    swaying = borne(synthetic(2.0, q=np.outer(0.11 * np.sin(np.pi * np.arange(2000) / 500), np.eye(9)[0])))
    assert measure(swaying, (0.0, 2.0))["stood"] == 0
    swings = [(250 + start, 500 + start, 0) for start in range(0, 1500, 500)]
    stepping = standing(synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7]), lifted(2000, *swings))
    assert measure(stepping, (0.0, 2.0))["stood"] == 0


@pytest.mark.parametrize(
    ("numbers", "words"),
    [({"slip": 1.01 * SLIP}, "its feet slide"), ({"sinking": 1.01 * SUNK}, "its feet sink into the ground"),
     ({"foot_support": 0.7}, "not borne by its feet"), ({"tilt": LEANING + 1.0}, "not upright"),
     ({"com_height": 0.99 * LOW}, "on the ground"), ({"pull": 1.01 * PULL}, "pulled along"),
     ({"support": 0.7}, "not borne by the ground"), ({"flight": 0.3}, "in the air")],
)  # fmt: skip
def test_feet_hold_bear_and_stay_above_the_ground(numbers, words):
    row = measure(walking(), (1.5, 3.0), **numbers)
    assert row["walked"] == 0
    assert outcome(row | {"end": "completed", "cause": ""}) == f"stayed up without walking: {words}"
    if not {"slip", "pull"} & set(numbers):
        still = borne(synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7]))
        assert measure(still, (0.5, 2.0), **numbers)["stood"] == 0


def test_whoever_lies_on_the_ground_does_not_stand():
    lying = borne(synthetic(2.0, q=[0.0, 1.3, 0.5 * math.pi, *[0.0] * 6]))
    row = measure(lying, (0.5, 2.0))
    assert row["tilt"] == pytest.approx(90.0)
    assert row["stood"] == 0


def test_feet_that_bear_nothing_do_not_stand():
    t = borne(synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7]))
    assert measure(t, (0.5, 2.0))["foot_support"] == pytest.approx(1.0)
    assert measure(t, (0.5, 2.0), foot_support=0.0, support=1.0)["stood"] == 0


def test_a_moment_is_too_short_to_say_that_anything_stood():
    still = borne(synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7]))
    assert [measure(still, (1.0, 1.0 + seconds))["stood"] for seconds in (0.1, 0.9, 1.0)] == [0, 0, 1]


def test_depth_is_of_the_window_in_leg_lengths():
    t = borne(synthetic(2.0, q=[0.0, 1.3, *[0.0] * 7]))
    deepest = float(-t.above[500:2001].min())
    assert measure(t, (0.5, 2.0))["sinking"] == pytest.approx(max(0.0, deepest) / t.robot.leg)
