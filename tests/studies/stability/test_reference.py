"""Walkers whose multipliers are known: T. McGeer's rimless wheel, and the simplest walker of Garcia et al. (1998)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from biped.base.errors import RunError
from biped.studies.stability.cycle import extrapolated, find_cycle, matched
from biped.studies.stability.reference import PUBLISHED, RimlessWheel, SimplestWalker, one_sided

WALKER = SimplestWalker()


@pytest.mark.parametrize(("alpha", "gamma"), [(math.pi / 8, 0.08), (math.pi / 6, 0.2), (0.3, 0.12)])
def test_rimless_wheel_is_as_in_closed_form(alpha, gamma):
    wheel = RimlessWheel(alpha, gamma)
    state, multiplier = wheel.exact()
    cycle = find_cycle(wheel.step, 1.1 * state, step=3e-5)
    assert cycle.state == pytest.approx(state, abs=1e-10)
    assert cycle.multipliers == pytest.approx(multiplier, abs=1e-7)
    assert abs(cycle.multipliers - multiplier) <= cycle.error
    assert cycle.stable


def variational(walker: SimplestWalker, z: np.ndarray) -> np.ndarray:
    """∂P/∂z (2, 2) by integrating the linearised equations and the shift of the heel strike: no differences."""
    theta, omega = z
    g = walker.gamma

    def rate(_t, y):
        th, w, ph, wp = y[:4]
        f = [w, math.sin(th - g), wp, math.sin(th - g) + math.sin(ph) * (w * w - math.cos(th - g))]
        A = np.zeros((4, 4))
        A[0, 1] = A[2, 3] = 1.0
        A[1, 0] = math.cos(th - g)
        A[3] = [math.cos(th - g) + math.sin(ph) * math.sin(th - g), 2 * w * math.sin(ph),
                math.cos(ph) * (w * w - math.cos(th - g)), 0.0]  # fmt: skip
        return np.concatenate([f, (A @ y[4:].reshape(4, 2)).ravel()])

    lift = np.array([[1.0, 0.0], [0.0, 1.0], [2.0, 0.0], [2 * math.sin(2 * theta) * omega, 1 - math.cos(2 * theta)]])
    start = np.concatenate([[theta, omega, 2 * theta, (1 - math.cos(2 * theta)) * omega], lift.ravel()])

    def strike(_t, y):
        return -1.0 if y[0] > -0.05 else y[2] - 2 * y[0]

    strike.terminal, strike.direction = True, 1.0
    y = solve_ivp(rate, (0, 20), start, method="DOP853", rtol=1e-12, atol=1e-12, events=strike).y_events[0][0]
    f, grad = rate(0.0, y)[:4], np.array([-2.0, 0.0, 1.0, 0.0])
    moved = (np.eye(4) - np.outer(f, grad) / (grad @ f)) @ y[4:].reshape(4, 2)
    impact = np.array([[-1.0, 0, 0, 0], [-2 * math.sin(2 * y[0]) * y[1], math.cos(2 * y[0]), 0, 0]])
    return impact @ moved


@pytest.mark.parametrize("known", PUBLISHED, ids=[known.name for known in PUBLISHED])
def test_simplest_walker_is_as_published(known):
    cycle = find_cycle(WALKER.step, np.array(known.state), step=3e-5)
    assert cycle.state == pytest.approx(known.state, abs=1e-9)
    # The authors' multipliers come from one-sided differences of 1e-5; in the same way the same digits come out.
    # (Of 4.000 and 0.459 the second is cut, not rounded.)
    alike = one_sided(WALKER, known.state)
    assert alike == pytest.approx(known.multipliers, abs=max(3e-8, 10.0**-known.digits))
    # The converged ones are those of the linearised equations of motion, and within their own error estimate.
    exact = np.linalg.eigvals(variational(WALKER, cycle.state))
    off = np.abs(cycle.multipliers - matched(cycle.multipliers, exact))
    assert off.max() < 1e-7
    assert (off <= cycle.error).all()
    assert cycle.stable == (known.name == "long period")


def test_error_estimate_follows_the_difference():
    """Central differences err with the square of their size, and what the estimate calls the error does."""
    z = np.array(PUBLISHED[0].state)
    errors = [find_cycle(WALKER.step, z, step=h, tolerance=1e-8).error.max() for h in (4e-4, 2e-4)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    exact = variational(WALKER, find_cycle(WALKER.step, z).state)
    better, plain = extrapolated(WALKER.step, z, 4e-4)
    assert np.abs(better - exact).max() < 0.1 * np.abs(plain - exact).max()


def test_no_step_and_no_cycle_are_errors():
    with pytest.raises(RunError, match="no step"):
        RimlessWheel().step(np.array([0.01]))  # too slow to vault over the spoke
    with pytest.raises(RunError, match="no fixed point"):
        find_cycle(lambda z: z + 1.0 + 0.1 * np.sin(z), np.array([0.3]))
