"""Systems a user writes: what is known of their motion is kept, and their functions agree or are named."""

from dataclasses import replace

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import EULER, RK4, RK8, ConstrainedSystem, integrate
from biped.dynamics.check import check_derivatives
from biped.dynamics.mechanisms import exercises, four_bars, pendulum, slider_crank
from tests.dynamics.systems import BEAD, FREE, FREE_Q, bead_b_v, no_force, skate_A, skate_b_v, skate_force, skate_mass


@pytest.mark.parametrize("scheme", [EULER, RK4, RK8, RK4.projected()], ids=lambda s: s.name)
@pytest.mark.parametrize("off", [0.0, 0.05])
def test_momentum_that_no_force_acts_on_stays(scheme, off):
    rng = np.random.default_rng(2)
    q, v = FREE_Q + off * rng.normal(size=8), rng.normal(size=8)  # neither satisfies the constraints
    r = integrate(FREE, q, v, duration=20.0, dt=2e-3, scheme=scheme)
    masses = np.array(FREE.params)
    momentum = np.einsum("i,kid->kd", masses, r.v.reshape(-1, 4, 2))
    np.testing.assert_allclose(momentum, momentum[[0]].repeat(len(momentum), 0), rtol=0, atol=1e-13)
    centre = np.einsum("i,kid->kd", masses, r.q.reshape(-1, 4, 2))
    np.testing.assert_allclose(centre - np.outer(r.t, momentum[0]), centre[[0]].repeat(len(centre), 0), atol=1e-11)


def test_a_nonholonomic_skate_follows_its_cycloid():
    """Spinning at ω on a slope, started at rest: x = a sin²(ωt)/2ω², y = a(ωt − sin ωt cos ωt)/2ω²."""
    a, w = 3.0, 1.7
    skate = ConstrainedSystem(
        n=3,
        m=1,
        mass=skate_mass,
        force=skate_force,
        phi=no_force,
        A=skate_A,
        b_v=skate_b_v,
        params=(a,),
        name="skate",
    )
    r = integrate(skate, [0, 0, 0], [0, 0, w], duration=20.0, dt=1e-2, scheme=RK8)
    s, c = np.sin(w * r.t), np.cos(w * r.t)
    np.testing.assert_allclose(r.q[:, 0], a * s * s / (2 * w * w), atol=1e-9)
    np.testing.assert_allclose(r.q[:, 1], a * (w * r.t - s * c) / (2 * w * w), atol=1e-9)
    assert r.phi_dot.max() < 1e-12


def test_a_bead_on_a_turning_rod_flies_out_as_cosh():
    r = integrate(BEAD, [1.0, 0.0], [0.0, 1.0], duration=3.0, dt=1e-2, scheme=RK8)
    exact = np.cosh(r.t)[:, None] * np.stack((np.cos(r.t), np.sin(r.t)), 1)
    np.testing.assert_allclose(r.q, exact, rtol=0, atol=1e-12)


def test_starting_later_is_the_same_motion_later():
    a = integrate(BEAD, [1.0, 0.0], [0.0, 1.0], duration=2.0, dt=1e-2)
    b = integrate(BEAD, a.q[100], a.v[100], t=1.0, duration=1.0, dt=1e-2)
    np.testing.assert_allclose(b.q, a.q[100:], atol=1e-9)


@pytest.mark.parametrize(
    "system",
    [
        pendulum.pendulum(2.0, 0.7),
        slider_crank.slider_crank(0.8, 1.3, 0.4),
        four_bars.four_bars(1),
        four_bars.four_bars(4, 0.9, 2.0),
        FREE,
        BEAD,
        *(exercises.exercise(k) for k in (1, 2, 3)),
    ],
    ids=lambda s: s.name,
)
def test_derivatives_agree_with_differences(system):
    rng = np.random.default_rng(11)
    for t in (0.0, 0.4):
        check_derivatives(system, t, rng.normal(size=system.n), rng.normal(size=system.n))


def test_a_wrong_derivative_is_named():
    wrong = replace(pendulum.pendulum(), b_v=bead_b_v)
    with pytest.raises(InputError, match=r"pendulum: b_v\[0\] is .* but differences give"):
        check_derivatives(wrong, 0.2, [0.3, 0.4], [1.0, 2.0])
