"""The biped's exercises of Figs 2.8–2.10: prescribed motions, the third with ten constraints of rank nine."""

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import integrate
from biped.dynamics.mechanisms import exercises as x


@pytest.fixture(scope="module", params=[1, 2, 3])
def run(request):
    r = integrate(x.exercise(request.param), x.STARTS[request.param], np.zeros(9), duration=100.0, dt=1e-2)
    return request.param, r


def test_residuals_are_the_thesis_s_own(run):
    number, r = run
    residual = max(r.phi[20:].max(), r.phi_dot[20:].max())
    assert residual == pytest.approx({1: 5.25e-11, 2: 2.71e-11, 3: 1.56e-12}[number], rel=0.01)


def test_configurations_repeat(run):
    number, r = run
    period = round(x.PERIODS[number] / 1e-2)
    cycles = r.q[period::period]
    np.testing.assert_allclose(cycles[1:], cycles[:-1], rtol=0, atol=1e-14)
    # Between those instants the time itself, and so its cosine, is rounded differently in every cycle.
    np.testing.assert_allclose(r.q[2 * period :], r.q[period:-period], rtol=0, atol=1e-13)


def test_the_rank_is_nine_of_nine_and_nine_of_ten(run):
    number, r = run
    assert x.exercise(number).m == (10 if number == 3 else 9)
    assert (r.rank == 9).all()


def test_the_motion_is_the_one_newton_s_method_finds(run):
    number, r = run
    system, q = x.exercise(number), x.STARTS[number]
    for k in (2500, 5137, 9999):
        for _ in range(30):
            e = system.evaluate(r.t[k], q, np.zeros(9))
            q = q - np.linalg.lstsq(e.A, e.phi, rcond=1e-12)[0]
        np.testing.assert_allclose(r.q[k], q, atol=1e-9)


def test_the_body_weighs_75_kg_and_inertia_grows_with_the_square_of_the_lengths():
    M = x.exercise(1).evaluate(0.0, x.STARTS[1], np.zeros(9)).M
    assert M[0, 0] == M[1, 1] == pytest.approx(75.0, abs=1e-12)
    assert M[2, 2] > 0.678 * 75.0 * (0.496 * x.TORSO) ** 2


def test_the_force_is_what_the_kinetic_energy_says():
    """M v̇ + ∂/∂t terms against Lagrange's equations, differentiated numerically."""
    system, h = x.exercise(1), 1e-6
    rng = np.random.default_rng(5)
    q, v = rng.normal(size=9), rng.normal(size=9)

    def kinetic(q):
        return 0.5 * v @ system.evaluate(0.0, q, v).M @ v

    slope = np.array([(kinetic(q + d) - kinetic(q - d)) / (2 * h) for d in h * np.eye(9)])
    M_dot = (system.evaluate(0, q + h * v, v).M - system.evaluate(0, q - h * v, v).M) / (2 * h)
    gravity = system.evaluate(0.0, q, np.zeros(9)).Q
    np.testing.assert_allclose(system.evaluate(0.0, q, v).Q, gravity + slope - M_dot @ v, atol=1e-6)


def test_there_are_three():
    with pytest.raises(InputError, match="1, 2 and 3, not 4"):
        x.exercise(4)
