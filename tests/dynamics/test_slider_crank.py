"""Chapter II's slider-crank: Figs 2.3 and 2.4, against its single angle."""

import numpy as np
import pytest

from biped.base.errors import RunError
from biped.dynamics import RK4, RK8, integrate
from biped.dynamics.mechanisms import slider_crank as s


@pytest.fixture(scope="module")
def exact():
    angle = integrate(s.trusted(), [0.0], [0.0], duration=100.0, dt=1e-3, scheme=RK8)
    half = integrate(s.trusted(), [0.0], [0.0], duration=100.0, dt=5e-4, scheme=RK8, every=2)
    assert np.abs(angle.q - half.q).max() < 1e-10  # the reference itself, turning 53 times
    return s.slider_position(angle.q)


@pytest.fixture(scope="module")
def consistent():
    return integrate(s.slider_crank(), *s.CONSISTENT, duration=100.0, dt=1e-3)


def test_as_accurate_as_the_trusted_solution(exact, consistent):
    trusted = integrate(s.trusted(), [0.0], [0.0], duration=100.0, dt=1e-3)
    assert np.abs(s.slider_position(trusted.q) - exact).max() == pytest.approx(4.33e-8, rel=0.01)
    assert np.abs(s.slider_position(consistent.q) - exact).max() == pytest.approx(4.33e-8, rel=0.01)


def test_constraints_far_below_machine_precision(consistent):
    assert consistent.phi.max() < 1e-15
    assert consistent.phi_dot.max() < 1e-10


def test_it_turns_through_its_singular_positions(consistent):
    assert consistent.q[-1, 2] > 20 * np.pi
    assert consistent.ratio.min() < 1e-3


def test_an_imperfect_start_is_mended_and_stays_so():
    r = integrate(s.slider_crank(), *s.INCONSISTENT, duration=100.0, dt=1e-3)
    assert r.phi[0] > 1e-3
    assert r.phi[5:].max() < 1e-15


def test_uncorrected_an_imperfect_start_drifts_away():
    r = integrate(s.slider_crank(), *s.INCONSISTENT, duration=20.0, dt=1e-3, scheme=RK4.uncorrected())
    assert r.phi[-1] > 0.1


@pytest.mark.parametrize("slider", [1e-9, 1e-3, 30.0, 1e3])
def test_other_mass_ratios(slider):
    params = (s.LENGTH, s.MASS, slider, s.GRAVITY, s.TORQUE, s.DAMPING)
    exact = integrate(s.trusted(params), [0.3], [2.0], duration=10.0, dt=1e-3, scheme=RK8)
    r = integrate(
        s.slider_crank(slider=slider),
        [0, 0, 0.3, -0.3],
        [0, 0, 2.0, -2.0],
        duration=10.0,
        dt=1e-3,
        scheme=RK8,
    )
    assert np.abs(s.slider_position(r.q) - s.slider_position(exact.q)).max() < 1e-7


@pytest.mark.parametrize("slider", [1e12, 1e20])
def test_a_mass_ratio_that_is_too_much_for_the_step_ends_with_an_error(slider):
    with pytest.raises(RunError, match=r"dt = 0\.001 s: at t = "):
        integrate(s.slider_crank(slider=slider), [0, 0, 0.3, -0.3], [0, 0, 2.0, -2.0], duration=10.0, dt=1e-3)
