"""Chapter II's four-bar linkages: Figs 2.5 and 2.6, singular positions, redundant rows, many linkages."""

from dataclasses import replace

import numpy as np
import pytest

from biped.base.errors import RunError
from biped.dynamics import RK4, RK8, integrate
from biped.dynamics.mechanisms import four_bars as f


def run(scheme=RK4, duration=100.0, dt=1e-2, start=f.CONSISTENT, system=None, **options):
    return integrate(system or f.four_bars(), *start, duration=duration, dt=dt, scheme=scheme, **options)


def error(r, reference, dt):
    return np.abs(r.q[:, 4] - reference[:: round(dt / 1e-3)]).max()


def angle(linkages=2, start=(np.pi / 2, -1.0), duration=10.0, dt=1e-2):
    return integrate(f.trusted(linkages), [start[0]], [start[1]], duration=duration, dt=dt, scheme=RK8).q[:, 0]


def test_steps_of_a_hundredth(four_bars_reference):
    r = run()
    assert r.ratio.min() < 1e-2  # it does go through its singular positions
    assert error(r, four_bars_reference, 1e-2) == pytest.approx(1.08e-2, rel=0.005)


def test_steps_of_a_hundredth_trusted(four_bars_reference):
    r = integrate(f.trusted(), [np.pi / 2], [-1.0], duration=100.0, dt=1e-2)
    assert np.abs(2.0 + np.cos(r.q[:, 0]) - four_bars_reference[::10]).max() == pytest.approx(1.72e-4, rel=0.005)


def test_steps_of_a_thousandth(four_bars_reference):
    # 1.08e-7 and a few per cent of rounding noise picked up in the singular positions.
    assert error(run(dt=1e-3), four_bars_reference, 1e-3) == pytest.approx(1.08e-7, rel=0.1)


@pytest.mark.parametrize("dt", [1e-2, 5e-3, 1e-3])
def test_uncorrected_it_blows_up_and_says_so(dt):
    with pytest.raises(RunError, match=r"t = \d.* is not finite"):
        run(RK4.uncorrected(), dt=dt)


def test_an_imperfect_start_does_not_drift():
    r = run(start=f.INCONSISTENT)
    assert r.phi[0] > 1e-2
    assert r.phi[4:].max() <= 3.1e-9
    assert r.phi[-2000:].max() <= 1.01 * r.phi[4:2000].max()


def test_energy_scaling(four_bars_reference):
    assert error(run(RK4.energy_scaled()), four_bars_reference, 1e-2) == pytest.approx(2.4e-5, rel=0.02)


def test_rk8_at_the_step_of_rk4(four_bars_reference):
    assert error(run(RK8), four_bars_reference, 1e-2) < 1e-7


def test_leaps_cure_what_short_steps_pick_up_in_singular_positions(four_bars_reference):
    whole, leapt = run(RK8.without_splitting(), dt=1e-3), run(RK8, dt=1e-3)
    assert whole.leaps == 0
    assert leapt.leaps > 0
    assert error(leapt, four_bars_reference, 1e-3) < 0.01 * error(whole, four_bars_reference, 1e-3)


def test_adaptive_steps_pass_the_singular_positions():
    r = run(RK8.adaptive(1e-9), duration=10.0, dt=0.05)
    assert np.abs(r.q[:, 4] - 2.0 - np.cos(angle(dt=0.05))).max() < 1e-6
    assert r.steps < 5000


def duplicated(system, scale):
    """The system with every constraint given a second time, in other units."""
    phi, A, b_v, m = system.phi, system.A, system.b_v, system.m

    def twice(function):
        from numba import njit

        single = njit(function)

        def both(t, q, v, p, out):
            single(t, q, v, p, out[:m])
            for i in range(m):
                out[m + i] = scale * out[i]

        return both

    return replace(system, m=2 * m, phi=twice(phi), A=twice(A), b_v=twice(b_v))


@pytest.mark.parametrize("scale", [1e3, 1e-5])
def test_duplicated_and_scaled_rows_change_nothing(scale, four_bars_reference):
    r = run(system=duplicated(f.four_bars(), scale))
    assert r.rank.max() == 5
    assert error(r, four_bars_reference, 1e-2) == pytest.approx(error(run(), four_bars_reference, 1e-2), rel=1e-4)


@pytest.mark.parametrize("rate", [-3.0, 1.0, 5.0])
@pytest.mark.parametrize("scheme", [RK4, RK8], ids=lambda s: s.name)
def test_a_start_exactly_in_the_singular_position(rate, scheme):
    r = run(scheme, 2.0, 1e-3, start=f.start(0.0, rate))
    assert r.rank.min() < 5
    exact = angle(start=(0.0, rate), duration=2.0, dt=1e-3)
    assert np.abs(r.q[:, 4] - 2.0 - np.cos(exact)).max() < 1e-8
    assert r.phi[-1] < 1e-12


@pytest.mark.parametrize("linkages", [1, 3, 8])
def test_other_numbers_of_linkages(linkages):
    r = run(RK8, 5.0, start=f.start(np.pi / 2, -1.0, linkages), system=f.four_bars(linkages))
    exact = angle(linkages, duration=5.0)
    np.testing.assert_allclose(r.q[:, -2], linkages + np.cos(exact), atol=1e-7)


def test_many_linkages_conserve_energy():
    system = f.four_bars(40)
    q, v = f.start(np.pi / 2, -1.0, 40)
    r = run(RK4, 3.0, start=(q, v), system=system, every=300)
    assert system.energy(3.0, r.q[-1], r.v[-1]) == pytest.approx(system.energy(0.0, q, v), rel=1e-6)
