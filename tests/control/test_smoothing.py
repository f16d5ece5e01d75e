"""Torques that go to what is asked for with a time constant and at most so fast; points that come to the ground."""

from __future__ import annotations

import numpy as np
import pytest
from msgspec.structs import replace

from biped.control.blending import downward, fraction, most_in_a_tick, smooth
from biped.scenario.devices import Actuation, Pushing
from biped.scenario.keys import Scenario, Simulation
from tests.ticks import Bench, states

PUSHING = Actuation(torque_limit=100.0, contacts="pushing")


@pytest.mark.parametrize("tick", [0.004, 0.001, 0.00025])
def test_a_step_is_followed_exponentially_at_any_rate(tick):
    u, latest, asked = np.zeros(2), np.zeros(2), np.array([100.0, -40.0])
    for k in range(1 + round(0.012 / tick)):
        u[:] = asked if k else 0.0
        smooth(u, latest, fraction(0.005, tick), most_in_a_tick(0.0, tick), k == 0)
    assert u == pytest.approx(asked * (1.0 - np.exp(-0.012 / 0.005)), rel=1e-12)


@pytest.mark.parametrize("rate", [1000.0, 250.0])
def test_torques_go_a_fraction_of_the_way_to_those_that_both_problems_ask_for(rate):
    simulation = Simulation(control_rate=rate)
    at_once = Bench(Scenario(actuation=PUSHING, simulation=simulation))
    smoothed = Bench(Scenario(actuation=replace(PUSHING, pushing=Pushing(smoothing=0.003)), simulation=simulation))
    follow, u, apart = 1.0 - np.exp(-1.0 / rate / 0.003), np.zeros(6), 0.0
    for k, (q, v) in enumerate(states(40, 7, speed=0.5)):
        asked, got = at_once.tick(q, v, k), smoothed.tick(q, v, k)
        u = asked if k == 0 else u + follow * (asked - u)
        np.testing.assert_allclose(got, u, rtol=1e-12, atol=1e-9)
        apart = max(apart, np.abs(got - asked).max())
    assert apart > 10.0, "torques hardly changed: the test would not see that they are smoothed"


@pytest.mark.parametrize("tick", [0.004, 0.001, 0.00025])
def test_a_step_is_followed_no_faster_than_its_slew_at_any_rate(tick):
    u, latest, asked = np.zeros(2), np.zeros(2), np.array([100.0, -40.0])
    for k in range(1 + round(0.012 / tick)):
        u[:] = asked if k else 0.0
        smooth(u, latest, 1.0, most_in_a_tick(5000.0, tick), k == 0)
    assert u == pytest.approx([60.0, -40.0], rel=1e-12)


@pytest.mark.parametrize("smoothing", [0.0, 0.003])
def test_no_torque_jumps_further_than_its_slew(smoothing):
    """And where a smoothed torque changes less than that, it is the smoothed one."""
    jumps = Bench(Scenario(actuation=replace(PUSHING, pushing=Pushing(smoothing=smoothing))))
    slow = Bench(Scenario(actuation=replace(PUSHING, pushing=Pushing(smoothing=smoothing, slew=10000.0))))
    before, u, bound, free = np.zeros(6), np.zeros(6), 0, 0
    for k, (q, v) in enumerate(states(40, 7, speed=0.5)):
        asked, u = jumps.tick(q, v, k), slow.tick(q, v, k).copy()
        if smoothing == 0.0:  # both are asked for the same
            np.testing.assert_allclose(u, asked if k == 0 else before + np.clip(asked - before, -10.0, 10.0), atol=1e-9)
            free += int((np.abs(asked - before) < 10.0).sum())
        if k > 0:
            assert np.abs(u - before).max() <= 10.0 + 1e-9
            bound += int((np.abs(u - before) > 10.0 - 1e-9).sum())
        before = u
    assert bound > 20, "torques hardly change: the test would not see that they may not jump"
    assert smoothing > 0.0 or free > 20


@pytest.mark.parametrize(("braking", "landing"), [(0.0, 0.6), (1.0, 0.0339)])
def test_a_point_that_brakes_lands_like_a_critically_damped_spring(braking, landing):
    """As fast as the motion may go down: from 60 mm at 0.6 m/s to 1 mm."""
    height, speed, tick, tau = 0.06, -0.6, 1e-5, 0.025
    while height > 0.001:
        speed -= tick * downward(speed, height, tau, braking) if height < -2.0 * speed * tau else 0.0
        height += tick * speed
    assert -speed == pytest.approx(landing, rel=0.01)  # the spring: h = (30 mm + 0.6 m/s t) e^(-t/τ)
