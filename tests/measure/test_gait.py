"""Steps and leg states: of known phases, of mirrored runs, at any rate of rows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from biped.measure.metrics import measure
from biped.measure.metrics.gait import commonest_cycle, strikes
from biped.measure.metrics.walking import walked
from biped.measure.trajectory import Trajectory
from tests.measure.made_up import borne, steady
from tests.runs import made, mirrored, synthetic


def test_leg_states_of_the_mirrored_run_are_the_other_legs():
    t = made("walk")
    mirror = commonest_cycle(mirrored(t), slice(0, None))
    left = [int(s) for s in t.phase[:, 1]]
    changes = [s for before, s in zip([0, *left], left, strict=False) if s != before]
    assert mirror["cycle"].split("-")[0] == "1"
    assert mirror["cycle"] in "-".join(map(str, changes))


def test_strikes_of_known_phases():
    phase = np.ones((1000, 2))
    phase[100:300, 0] = 3
    phase[250:300, 0] = 4
    phase[400:600, 1] = 3
    phase[700:740, 0] = 3  # a bounce of 40 rows
    phase[900:, 1] = 3  # not yet down
    assert strikes(phase, 0.001) == [(300, 0), (600, 1)]


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


@pytest.mark.parametrize("rate", [500.0, 2000.0])
def test_metrics_count_seconds_not_rows(rate):
    """One run, its rows taken at another rate: every duration and every step stays what it was."""
    t = made("long")
    other = resampled(t, rate)
    assert len(strikes(other.phase, other.tick)) == len(strikes(t.phase, t.tick)) >= 4
    for (row, leg), (there, same) in zip(strikes(t.phase, t.tick), strikes(other.phase, other.tick), strict=True):
        assert leg == same
        assert there * other.tick == pytest.approx(row * t.tick, abs=2.1e-3)
    one, two = measure(t, (1.0, 5.0)), measure(other, (1.0, 5.0))
    for name in ("steps", "alternation"):
        assert two[name] == one[name], name
    assert walked(one, 5.0, t.robot.walked)
    assert walked(two, 5.0, t.robot.walked)
    for name in ("step_length", "step_frequency", "speed", "clearance", "double_support", "cost_of_transport"):
        assert two[name] == pytest.approx(one[name], rel=0.02), name


def test_bounces_and_swings_are_told_apart_by_seconds():
    """A foot 40 ms in the air has bounced, one of 60 ms stepped; a swing of 90 ms has no clearance, one of 110 has."""
    for rate in (500, 1000, 2000, 4000):
        for ms, stepped in ((40, 0), (60, 1)):
            phase = np.ones((rate, 2))
            phase[rate // 10 : rate // 10 + ms * rate // 1000, 0] = 3
            assert len(strikes(phase, 1.0 / rate)) == stepped, (rate, ms)
        for ms, cleared in ((90, False), (110, True)):
            phase = np.ones((1000, 2))
            phase[100 : 100 + ms, 0] = 3
            t = resampled(borne(synthetic(1.0, q=[0.0, 1.3, *[0.0] * 7], phase=phase)), rate)
            assert math.isfinite(measure(t, (0.0, 1.0))["clearance"]) == cleared, (rate, ms)


def resampled(t: Trajectory, rate: float) -> Trajectory:
    """The run with its rows at another rate [Hz]: every second one, or each twice."""
    if rate * t.tick < 1.0:
        step = round(1.0 / (rate * t.tick))
        return replace(t, log=t.log[::step].copy(), tick=t.tick * step, sampled=True)
    times = round(rate * t.tick)
    log = np.repeat(t.log, times, axis=0)
    log[:, 0] += np.tile(np.arange(times) * t.tick / times, len(t))
    return replace(t, log=log, tick=t.tick / times)
