"""Adaptive steps: the error goes with the tolerance, or an error says why not."""

import numpy as np
import pytest

from biped.base.errors import RunError
from biped.dynamics import RK8, ConstrainedSystem, integrate
from biped.dynamics.mechanisms import four_bars, pendulum, slider_crank


@pytest.mark.parametrize("linkages", [2, 5, 10])
def test_chains_through_their_singular_positions(linkages):
    exact = integrate(four_bars.trusted(linkages), [np.pi / 2], [-1.0], duration=5.0, dt=1e-3, sampling=0.1, scheme=RK8)
    start = four_bars.start(np.pi / 2, -1.0, linkages)
    errors = []
    for tolerance in (1e-6, 1e-8, 1e-10):
        r = integrate(four_bars.four_bars(linkages), *start, duration=5.0, sampling=0.1, scheme=RK8.adaptive(tolerance))
        errors.append(np.abs(r.q[:, -2] - linkages - np.cos(exact.q[:, 0])).max() / tolerance)
    assert max(errors) < 1e4
    assert errors[-1] < 30 * errors[0]


def double_mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = p[0]
    M[2, 2] = M[3, 3] = p[1]


def double_force(t, q, v, p, Q):
    Q[1] = -9.81 * p[0]
    Q[3] = -9.81 * p[1]


def double_phi(t, q, v, p, out):
    out[0] = q[0] ** 2 + q[1] ** 2 - 1.0
    out[1] = (q[2] - q[0]) ** 2 + (q[3] - q[1]) ** 2 - 1.0


def double_A(t, q, v, p, out):
    for d in range(2):
        out[0, d] = 2 * q[d]
        out[1, d] = -2 * (q[2 + d] - q[d])
        out[1, 2 + d] = 2 * (q[2 + d] - q[d])


def double_b_v(t, q, v, p, out):
    out[0] = -2 * (v[0] ** 2 + v[1] ** 2)
    out[1] = -2 * ((v[2] - v[0]) ** 2 + (v[3] - v[1]) ** 2)


def double_potential(t, q, v, p):
    return 9.81 * (p[0] * q[1] + p[1] * q[3])


DOUBLE = ConstrainedSystem(
    n=4,
    m=2,
    mass=double_mass,
    force=double_force,
    phi=double_phi,
    A=double_A,
    b_v=double_b_v,
    potential=double_potential,
    name="double pendulum",
)


@pytest.mark.parametrize("masses", [(1e-6, 1.0), (1.0, 1e-6), (1.0, 1.0)])
def test_light_masses_are_no_excuse(masses):
    """A pivot ratio of 1e-3 and less, everywhere, from the masses alone: nothing is singular, nothing is waived."""
    system = DOUBLE.with_params(masses)
    start = ([1.0, 0.0, 2.0, 0.0], np.zeros(4))

    def run(tolerance):
        return integrate(system, *start, duration=1.0, sampling=0.1, scheme=RK8.adaptive(tolerance)).q

    exact = run(1e-13)
    errors = [np.abs(run(tolerance) - exact).max() / tolerance for tolerance in (1e-5, 1e-7, 1e-9, 1e-11)]
    assert max(errors) < 1e3


def test_a_chain_that_cannot_close_is_an_error_at_adaptive_steps_too():
    """A rod of 1 m cannot reach from the origin to a rail 2 m away."""

    def far_phi(t, q, v, p, out):
        out[0] = q[0] ** 2 + q[1] ** 2 - 1.0
        out[1] = q[0] - 2.0

    def far_A(t, q, v, p, out):
        out[0, 0], out[0, 1] = 2 * q[0], 2 * q[1]
        out[1, 0] = 1.0

    def far_b_v(t, q, v, p, out):
        out[0] = -2 * (v[0] ** 2 + v[1] ** 2)

    system = ConstrainedSystem(
        n=2, m=2, mass=pendulum.pendulum().mass, force=pendulum.pendulum().force, phi=far_phi, A=far_A, b_v=far_b_v,
        params=(1.0, 1.0, 9.81), name="too short",
    )  # fmt: skip
    with pytest.raises(RunError, match=r"does not (settle|converge)|not finite|no step passes"):
        integrate(system, [1.0, 0.5], [0.0, 0.0], duration=5.0, sampling=0.1, scheme=RK8.adaptive(1e-8))


@pytest.mark.parametrize("problem", ["pendulum", "slider-crank"])
def test_the_error_goes_with_the_tolerance_over_eight_decades(problem):
    tolerances = 10.0 ** -np.arange(3, 12, 2)
    errors = []
    if problem == "slider-crank":
        fine = integrate(slider_crank.trusted(), [0.0], [0.0], duration=5.0, dt=1e-3, sampling=1.0, scheme=RK8)
    for tolerance in tolerances:
        scheme = RK8.adaptive(tolerance)
        if problem == "pendulum":
            r = integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=10.0, sampling=1.0, scheme=scheme)
            errors.append(np.abs(r.q - pendulum.exact(r.t)).max())
        else:
            system, start = slider_crank.slider_crank(), slider_crank.CONSISTENT
            r = integrate(system, *start, duration=5.0, sampling=1.0, scheme=scheme)
            gap = slider_crank.slider_position(r.q) - slider_crank.slider_position(fine.q)
            errors.append(np.abs(gap).max())
    slope = np.polyfit(np.log10(tolerances), np.log10(errors), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.2)
    assert (errors < 1e4 * tolerances).all()
