"""Metrics as a whole: which there are, of whom, and what becomes of them in an ensemble."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from biped.measure.metrics import Totals, measure
from biped.scenario.metrics import METRICS
from tests.measure.made_up import borne, steady
from tests.runs import made, mirrored


def test_every_name_is_measured():
    numbers = measure(made("walk"), (0.0, 2.0))
    assert set(METRICS) <= set(numbers)
    missing = [name for name in METRICS if not math.isfinite(numbers[name])]
    # Two seconds have two steps; neither motors nor an estimator; no push, no change.
    motors = ["cost_of_transport_heat", "cost_of_transport_electrical", "motor_load", "gear_load", "beyond_gear"]
    posture = ["torso_error", "torso_error_worst", "underactuated", "longest_gap", "gyro_clipped"]
    pushes = ["pull", "push_impulse", "push_speed", "push_froude", "push_share", "recovery_time"]
    steps = ["first_step", "second_step", "third_step", "fourth_step"]
    command = ["commanded", "command_error", "yaw_error"]
    space = ["step_width", "cross_over", "margin_of_stability", "heading", "drift", "veering"]
    assert sorted(missing) == sorted(
        ["stopping_distance", "seat_load", *motors, "beyond_line", *posture, *pushes, *steps, *space, *command]
    )


@pytest.mark.parametrize("name", ["walk", "pushed", "generalized"])
def test_right_and_left_are_alike(name):
    t = made(name)
    window = (0.0, t.time[-1])
    one, two = measure(t, window), measure(mirrored(t), window)
    for key in METRICS:
        assert two[key] == pytest.approx(one[key], rel=1e-9, nan_ok=True), key
    for joint in one["per_joint"]:
        assert two["per_joint"][joint] == pytest.approx(one["per_joint"][joint])


def test_speed_of_a_steady_run():
    numbers = measure(steady(), (1.0, 2.0))
    assert numbers["speed"] == pytest.approx(0.5)
    assert numbers["speed_std"] == pytest.approx(0.0, abs=1e-12)
    assert numbers["distance"] == pytest.approx(0.5 * 1.999)
    assert numbers["time"] == pytest.approx(2.0)
    leg = (0.245 + 0.246 + 0.039) * 1.8
    assert numbers["froude"] == pytest.approx(0.5 / math.sqrt(9.81 * leg), rel=1e-6)


def test_a_run_that_ended_before_the_window_has_no_means():
    early = replace(borne(steady()), end="fell", cause="x")
    numbers = measure(early, (3.0, 4.0))
    assert math.isnan(numbers["speed"])
    assert math.isfinite(numbers["peak_torque"])
    assert numbers["falls"] == 1


def aggregate(runs):
    totals = Totals()
    totals.add({name: np.array([run[name] for run in runs], dtype=float) for name in METRICS})
    return totals.numbers


def test_ensemble_means_are_over_walkers():
    walker = dict.fromkeys(METRICS, 1.0) | {"falls": 0, "diverged": 0, "doubtful": 0, "walked": 1, "stood": 0}
    runs = [walker, walker | {"speed": 2.0}, walker | {"speed": 9.0, "walked": 0, "falls": 1}]
    whole = aggregate(runs)
    assert (whole["falls"], whole["walked"], whole["speed"]) == (1, 2, 1.5)
    assert aggregate(runs[2:])["speed"] == 9.0
    assert math.isnan(aggregate([runs[2] | {"speed": math.nan}])["speed"])
