"""The capturability bound: against the recursion in print, against pendulums that are stepped, and on made-up walks."""

from __future__ import annotations

import math

import numpy as np
import pytest

from biped.measure.metrics.pushed import capture_radius, largest_push, push_share, pushed
from tests.measure.test_pushed import STEP, walk

FOOT, REACH, TIME = 0.12, 0.9, 1.3
"""In heights of the centre of mass, and in √(z/g)."""


@pytest.mark.parametrize("steps", [0, 1, 2, 5])
def test_it_is_the_recursion_in_print(steps):
    """Koolen et al. 2012: d_0 = r, d_N = r + (l + d_(N-1) - r) exp(-Δt)."""
    d = FOOT
    for _ in range(steps):
        d = FOOT + (REACH + d - FOOT) * math.exp(-TIME)
    assert capture_radius(FOOT, REACH, TIME, steps=steps) == pytest.approx(d, rel=1e-12)
    assert d < capture_radius(FOOT, REACH, TIME) == pytest.approx(capture_radius(FOOT, REACH, TIME, steps=200))


def stepped(centre, left, force, lasting, choose, steps=8):
    """Whether a pendulum that is pushed is still near its foot after so many steps.

    Args:
        centre: Extrapolated centre of mass from the middle of the foot.
        left: Until the first strike.
        force: In m g, for the time `lasting`.
        lasting: Of it.
        choose: Given ξ from the foot, whether it is a strike, and whether the push lasts: the centre of pressure in
            units of the foot's radius; at a strike, the way to the next foot in units of the reach.
    """
    foot, time, strike, dt, done = 0.0, 0.0, left, 1e-2, 0
    while done < steps:
        pressure = foot + FOOT * np.clip(choose(centre - foot, False, time < lasting), -1.0, 1.0)
        pushed = force if time < lasting else 0.0
        centre = pressure - pushed + (centre - pressure + pushed) * math.exp(dt)  # exact where both are constant
        time += dt
        if time >= strike - 1e-9:
            foot += REACH * np.clip(choose(centre - foot, True, time < lasting), -1.0, 1.0)
            strike, done = strike + TIME, done + 1
        if abs(centre - foot) > 20.0:
            return False
    return abs(centre - foot) <= capture_radius(FOOT, REACH, TIME)


def best(off, strikes, lasts):
    """Goes as far as it can while the push lasts, which it knows of, and no farther than to ξ after it."""
    return 1.0 if lasts else off / REACH if strikes else 2.0 * off / FOOT


@pytest.mark.parametrize(("left", "lasting", "centre"), [(0.0, 0.3, 0.2), (1.3, 0.6, -0.3), (0.7, 2.0, 0.1)])
def test_the_best_law_survives_just_less_and_none_survives_more(left, lasting, centre):
    """The largest push by the formula, against a pendulum that is stepped: also through pushes that outlast a step."""
    radius = capture_radius(FOOT, REACH, TIME, left)
    shift = largest_push(np.array([centre, 0.0]), np.zeros(2), radius, np.array([1.0, 0.0]))
    force = shift / -math.expm1(-lasting)
    assert stepped(centre, left, 0.99 * force, lasting, best)
    assert not stepped(centre, left, 1.01 * force, lasting, best)
    rng, survived = np.random.default_rng(3), 0
    for _ in range(60):
        eager = rng.uniform(0.5, 3.0, 2)
        law = lambda off, strikes, _, e=eager: e[int(strikes)] * off + 0.2 * rng.standard_normal()  # noqa: E731
        assert not stepped(centre, left, 1.02 * force, lasting, law)
        survived += stepped(centre, left, 0.3 * force, lasting, law)
    assert survived > 12, "a law that is not the best survives less"


def test_in_space_it_is_the_distance_to_a_circle():
    way = np.array([0.6, 0.8])
    moved = largest_push(np.array([0.3, -0.1]), np.array([0.1, 0.1]), 0.7, way)
    assert np.linalg.norm(np.array([0.2, -0.2]) + moved * way) == pytest.approx(0.7)
    assert largest_push(np.array([2.0, 0.0]), np.zeros(2), 0.7, way) == 0.0, "it is lost already"
    assert largest_push(np.array([0.8, 0.0]), np.zeros(2), 0.7, np.array([1.0, 0.0])) == 0.0


def test_of_a_walk_whose_numbers_are_known():
    t = walk([1.0] * 12, ((3.1, 3.3, 200.0, 0.0, "torso"),))
    row, leg, mass = 3100, t.robot.leg, t.mass
    tau = math.sqrt(t.com[row, 2] / 9.81)
    step, lasting = STEP / tau, 0.2 / tau
    centre = t.com[row, 0] + tau * t.com_velocity[row, 0]
    most = 0.0
    for foot in np.flatnonzero(t.down[row]):
        heel, toe = t.point[row, [2 * foot, 2 * foot + 1], 0]
        reach = leg * math.exp(-(step - 0.1 / tau)) / (1.0 - math.exp(-step))
        most = max(most, 0.5 * abs(toe - heel) + reach - (centre - 0.5 * (heel + toe)))
    expected = 40.0 / mass * tau * (1.0 - math.exp(-lasting)) / lasting / most
    assert push_share(t, 3.1, 3.3, (40.0, 0.0, 0.0)) == pytest.approx(expected, rel=1e-6)
    assert push_share(t, 3.1, 3.3, (80.0, 0.0, 0.0)) == pytest.approx(2.0 * expected, rel=1e-6)
    assert push_share(t, 3.1, 3.3, (-40.0, 0.0, 0.0)) != pytest.approx(expected, rel=0.01)
    assert math.isnan(push_share(t, 3.1, 3.3, (0.0, 0.0, 40.0))), "straight up"
    assert math.isnan(push_share(t, 0.2, 0.4, (40.0, 0.0, 0.0))), "before the first steps"
    assert math.isnan(push_share(t, 3.1, 4.8, (40.0, 0.0, 0.0))), "no push, but a wind"


def test_a_push_that_begins_within_the_last_tick_of_a_run_has_no_share():
    whole = walk([1.0] * 12, ())
    until = len(whole) * whole.tick
    t = walk([1.0] * 12, ((until - 0.4e-3, until + 0.2, 200.0, 0.0, "torso"),))
    assert t.tick == pytest.approx(1e-3)
    found = pushed(t)
    assert found["push_impulse"] > 0.0
    assert math.isnan(found["push_share"])
