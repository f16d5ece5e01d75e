"""Adaptive steps: the error goes with the tolerance, or an error says why not."""

import numpy as np
import pytest

from biped.base.errors import RunError
from biped.dynamics import RK8, ConstrainedSystem, integrate
from biped.dynamics.bench.tolerances import cases, measure, slope
from biped.dynamics.mechanisms import double_pendulum as double
from biped.dynamics.mechanisms import four_bars, pendulum


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


@pytest.mark.parametrize("masses", [(1e-6, 1.0), (1.0, 1e-6), (1.0, 1.0)])
def test_light_masses_are_no_excuse(masses):
    """A pivot ratio of 1e-3 and less from the masses alone: nothing is singular, nothing is waived."""
    options = {"duration": 1.0, "sampling": 0.1}
    angles = integrate(double.trusted(*masses), np.zeros(2), np.zeros(2), **options, dt=1e-5, scheme=RK8).q
    system = double.double_pendulum(*masses)
    for tolerance in (1e-5, 1e-7, 1e-9, 1e-11):
        r = integrate(system, *double.START, **options, scheme=RK8.adaptive(tolerance))
        assert np.abs(r.q - double.position(angles)).max() < 1e3 * tolerance


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


CASES = {case.name: case for case in cases()}
LONG = [name for name in CASES if name.startswith(("chain of 10", "chain of 40", "Bennett", "Bricard"))]


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] if n in LONG else []) for n in CASES])
def test_the_error_goes_with_the_tolerance_over_eight_decades(name):
    reached = measure((CASES[name],))
    assert all(r.error is not None for r in reached), [r.note for r in reached]
    assert slope(reached) == pytest.approx(1.0, abs=0.25)
    assert max(r.error / r.tolerance for r in reached) < 1e4
