"""Steps and leg states: of known contacts, of mirrored runs, at any rate of rows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from biped.measure.contact import feet_down, strikes_of, swings_of
from biped.measure.metrics import measure
from biped.measure.metrics.belief import commonest_cycle
from biped.measure.metrics.walking import walked
from biped.measure.trajectory import Trajectory
from tests.measure.made_up import WEIGHT, lifted, standing, steady
from tests.runs import made, mirrored, synthetic


def test_leg_states_of_the_mirrored_run_are_the_other_legs():
    t = made("walk")
    mirror = commonest_cycle(mirrored(t).phase[:, 0])
    left = [int(s) for s in t.phase[:, 1]]
    changes = [s for before, s in zip([0, *left], left, strict=False) if s != before]
    assert mirror["cycle"].split("-")[0] == "1"
    assert mirror["cycle"] in "-".join(map(str, changes))


def test_strikes_of_known_contacts():
    down = lifted(1000, (100, 300, 0), (400, 600, 1), (700, 740, 0), (900, 1000, 1))  # a bounce; not yet down
    t = standing(synthetic(1.0), down)
    assert t.strikes == [(300, 0), (600, 1)]
    down[700:740, 0] = True
    np.testing.assert_array_equal(t.down, down)
    assert [swings_of(t.down, foot) for foot in (0, 1)] == [[slice(100, 300)], [slice(400, 600)]]


def test_contacts_that_chatter_are_contacts():
    """Every third tick alone bears force, as rigid feet do; a toe touches 20 ms in a swing."""
    down = lifted(1000, (300, 500, 0))
    chattering = down & (np.arange(1000) % 3 == 0)[:, None]
    chattering[400:420, 0] = True
    t = standing(synthetic(1.0), chattering)
    assert t.strikes == [(501, 0)]
    for rows in (slice(0, 295), slice(300, 498), slice(501, 995)):  # to the tick that bore force last
        np.testing.assert_array_equal(t.down[rows], down[rows])


def test_what_a_law_believes_and_senses_changes_no_number():
    """The judge is never the accused: leg states, believed contacts and sensed heights are the law's."""
    t = made("long")
    honest = measure(t, (1.0, 5.0))
    lied = replace(t, log=t.log.copy())
    rng = np.random.default_rng(5)
    for name in ("phase", "believed", "active", "height"):
        lied.column(name)[:] = rng.integers(0, 5, lied.column(name).shape)
    fooled = measure(lied, (1.0, 5.0))
    assert honest["switches"] != fooled["switches"]
    for name in honest.keys() - {"switches", "constraint_switches", "leg_states"}:
        np.testing.assert_equal(fooled[name], honest[name], name)


def test_steps_and_support_of_known_contacts():
    # The same leg twice: with both, errors of either would cancel.
    t = standing(steady(), lifted(2000, (1100, 1300, 0), (1500, 1800, 0)))
    t.q[:, 3], t.q[:, 6] = 0.3, -0.3  # right thigh ahead
    t.q[:, 5], t.q[:, 8] = -0.3, 0.3  # feet flat
    numbers = measure(t, (1.0, 2.0))
    assert numbers["stance_knee"] == 0.0
    assert numbers["steps"] == 2
    assert numbers["step_frequency"] == pytest.approx(2.0)
    assert numbers["step_duration"] == pytest.approx(0.5)
    assert numbers["step_length"] == pytest.approx(2 * math.sin(0.3) * 0.491 * 1.8, rel=1e-9)
    assert numbers["double_support"] == pytest.approx(0.5)
    assert numbers["duty"] == pytest.approx(0.75)
    assert numbers["flight"] == 0.0
    assert numbers["alternation"] == 0.0


def test_the_knee_that_bears_the_walker_is_looked_at_in_the_middle_of_its_support():
    t = standing(steady(), lifted(2000, (1100, 1300, 0), (1500, 1900, 1)))
    t.q[:, 4], t.q[:, 7] = -1.0, -2.0
    t.q[1150:1250, 7] = -0.1  # the left leg bears the walker while the right one swings
    t.q[1600:1800, 4] = -0.4
    flexed = (100 * 0.1 + 200 * 0.4) / 300
    assert measure(t, (1.0, 2.0))["stance_knee"] == pytest.approx(math.degrees(flexed), rel=1e-9)


def test_leg_state_cycle():
    one = [1] * 100 + [2] * 50 + [3] * 200 + [4] * 50
    odd = [1] * 100 + [3] * 300
    phase = np.ones((2000, 2))
    phase[:, 0] = one + one + odd + one + one
    found = commonest_cycle(phase[:, 0])
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
    assert len(other.strikes) == len(t.strikes) >= 4
    for (row, leg), (there, same) in zip(t.strikes, other.strikes, strict=True):
        assert leg == same
        assert there * other.tick == pytest.approx(row * t.tick, abs=2.1e-3)
    one, two = measure(t, (1.0, 5.0)), measure(other, (1.0, 5.0))
    for name in ("steps", "alternation"):
        assert two[name] == one[name], name
    assert walked(one, 5.0, t.robot.walked)
    assert walked(two, 5.0, t.robot.walked)
    # The work needs the torque of every tick, and of every other row half of them are lost.
    costs = ("cost_of_transport",) if other.tick <= t.tick else ()
    for name in ("step_length", "step_frequency", "speed", "clearance", "double_support", *costs):
        assert two[name] == pytest.approx(one[name], rel=0.02), name


def test_bounces_and_swings_are_told_apart_by_seconds():
    """A foot 40 ms in the air has bounced, one of 60 ms stepped; a swing of 90 ms has no clearance, one of 110 has."""
    for rate in (500, 1000, 2000, 4000):
        for ms, stepped in ((40, 0), (60, 1)):
            force = np.full((rate, 2), 100.0)
            force[rate // 10 : rate // 10 + ms * rate // 1000, 0] = 0.0
            assert len(strikes_of(feet_down(force, WEIGHT, 1.0 / rate), 1.0 / rate)) == stepped, (rate, ms)
        for ms, cleared in ((90, False), (110, True)):
            still = synthetic(1.0, q=[0.0, 1.3, *[0.0] * 7])
            t = resampled(standing(still, lifted(1000, (100, 100 + ms, 0))), rate)
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
