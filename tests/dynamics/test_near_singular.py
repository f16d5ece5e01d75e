"""Starts and samples beside a singular position, from 0.1 rad to exactly there: what double precision leaves."""

from dataclasses import replace

import numpy as np
import pytest

from biped.dynamics import RK8, integrate
from biped.dynamics.collocation import ERROR, INTEGRAL, NODE, NODES, WEIGHT, WITHOUT, table
from biped.dynamics.mechanisms import four_bars

ANGLES = (0.0, *(10.0**-k for k in range(1, 15)))


def in_one_angle(angle, rate, duration, dt):
    return integrate(four_bars.trusted(), [angle], [rate], duration=duration, dt=dt / 20, sampling=dt, scheme=RK8)


def states(r):
    """q and v of the joints from the single angle."""
    a, w, none = r.q[:, 0], r.v[:, 0], np.zeros(len(r.t))
    q = [x for j in range(3) for x in (j + np.cos(a), np.sin(a) + none)]
    v = [x for _ in range(3) for x in (-w * np.sin(a), w * np.cos(a))]
    return np.stack(q, 1), np.stack(v, 1)


@pytest.mark.parametrize("rate", [1.0, -1.0])
def test_starts_beside_a_flat_position_keep_the_order_of_the_scheme(rate):
    """Away from it and through it: 8th order, down to 1e-11 after 10 s (1.1e-6 with stages as they come)."""
    for angle in ANGLES:
        errors = []
        for dt in (0.04, 0.02):
            exact = states(in_one_angle(angle, rate, 10.0, dt))[0]
            r = integrate(four_bars.four_bars(), *four_bars.start(angle, rate), duration=10.0, dt=dt, scheme=RK8)
            errors.append(np.abs(r.q - exact).max())
        assert errors[1] < 1e-11, angle
        assert np.log2(errors[0] / errors[1]) > 7.5, angle


@pytest.mark.parametrize("scheme", [RK8, RK8.adaptive(1e-11)], ids=lambda s: s.name)
def test_velocities_sampled_beside_a_flat_position(scheme):
    """The last sample so long before or after it, both in q and v; 2e-7 … 2e-6 where v is projected there."""

    def flat(t, q, v, p, out):
        out[0] = q[0]

    upright = ([np.pi / 2], [-1.0])
    alone = replace(four_bars.trusted(), event=flat, events=("flat",))
    when = integrate(alone, *upright, duration=2.0, dt=1e-3, scheme=RK8).t[-1]
    for apart in (-1e-2, -1e-4, -1e-7, -1e-10, -1e-13, 0.0, 1e-13, 1e-10, 1e-7, 1e-4, 1e-2):
        duration = when + apart
        steps = {"sampling": duration} if scheme.rtol else {"dt": duration / round(duration / 0.01)}
        r = integrate(four_bars.four_bars(), *four_bars.CONSISTENT, duration=duration, scheme=scheme, **steps)
        q, v = states(in_one_angle(*(x[0] for x in upright), duration, duration / round(duration / 0.01)))
        assert np.abs(r.q[-1] - q[-1]).max() < (1e-9 if scheme.rtol else 1e-12), apart
        assert np.abs(r.v[-1] - v[-1]).max() < 1e-9, apart


@pytest.mark.parametrize("linkages", [2, 40])
def test_a_leap_costs_no_more_than_a_few_steps(linkages):
    """Eight nodes, six iterations or seven, hardly more than one evaluation each: 137 where every node began anew."""
    start = four_bars.start(np.pi / 2, -1.0, linkages)
    r = integrate(four_bars.four_bars(linkages), *start, duration=3.0, dt=0.05, scheme=RK8)
    exact = integrate(four_bars.trusted(linkages), [np.pi / 2], [-1.0], duration=3.0, dt=1e-3, every=50, scheme=RK8)
    assert np.abs(r.q[:, -2] - linkages - np.cos(exact.q[:, 0])).max() < 3e-7
    stages = 12 * (r.steps - r.leaps)
    assert 6 <= r.leaps <= 10
    assert r.evaluations - stages < 80 * r.leaps


def test_what_a_leap_integrates_and_interpolates():
    gauss = table()
    c = gauss[NODE]
    for k in range(NODES):
        np.testing.assert_allclose(gauss[INTEGRAL : INTEGRAL + NODES] @ c**k, c ** (k + 1) / (k + 1), atol=1e-15)
    for k in range(2 * NODES):
        assert gauss[WEIGHT] @ c**k == pytest.approx(1 / (k + 1), rel=1e-13)
    for k in range(NODES - 1):
        np.testing.assert_allclose(gauss[WITHOUT : WITHOUT + NODES] @ c**k, c**k, atol=1e-14)
    np.testing.assert_allclose(np.diag(gauss[WITHOUT : WITHOUT + NODES]), 0.0)
    seen = [[abs(gauss[ERROR + i] @ (c - 0.5) ** k) > 1e-9 for k in range(8)] for i in (0, 1)]
    assert seen == [[k == 6 for k in range(8)], [k in (4, 6) for k in range(8)]]
