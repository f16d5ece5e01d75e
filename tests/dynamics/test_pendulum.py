"""Chapter II's pendulum: Figs 2.1 and 2.2 and the orders of convergence, against the exact solution."""

import numpy as np
import pytest

from biped.dynamics import EULER, RK4, RK8, integrate
from biped.dynamics.mechanisms import pendulum as p


def run(scheme=RK4, duration=10.0, dt=1e-2, start=p.CONSISTENT, **options):
    return integrate(p.pendulum(), *start, duration=duration, dt=dt, scheme=scheme, **options)


def error(r):
    return np.linalg.norm(r.q - p.exact(r.t), axis=1).max()


@pytest.fixture(scope="module")
def thousand_seconds():
    return run(duration=1000.0, dt=1e-3)


def test_the_exact_solution_obeys_energy_and_the_equation_of_motion():
    h, t = 1e-4, np.linspace(0.3, 40.0, 1000)
    before, now, after = (p.exact(t + k * h) for k in (-1, 0, 1))
    v = (after - before) / (2 * h)
    np.testing.assert_allclose(np.linalg.norm(now, axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(0.5 * (v**2).sum(axis=1) + p.GRAVITY * now[:, 1], 0.0, atol=1e-5)
    np.testing.assert_allclose(p.exact(np.zeros(1)), [[1.0, 0.0]], atol=1e-15)


def test_a_thousand_seconds_stay_on_the_exact_solution(thousand_seconds):
    assert error(thousand_seconds) < 1e-7


def test_a_thousand_seconds_stay_on_the_constraints(thousand_seconds):
    assert thousand_seconds.phi.max() <= 1e-14
    assert thousand_seconds.phi_dot.max() <= 3e-13


def test_a_million_steps_do_not_drift(thousand_seconds):
    phi = thousand_seconds.phi
    assert phi.size == 1_000_001
    assert phi[-10_000:].max() <= phi[:10_000].max()


def test_uncorrected_it_drifts():
    r = run(RK4.uncorrected(), 1000.0, 1e-3)
    assert error(r) == pytest.approx(9.9e-3, rel=0.01)
    assert r.phi[-1] > 1e-5


def test_the_imperfect_start_of_fig_2_1_is_free_of_drift_after_three_steps():
    r = run(duration=1000.0, dt=1e-3, start=p.INCONSISTENT)
    assert r.phi[0] > 1e-5
    assert r.phi[3:].max() < 1e-12


FIG_2_2 = {
    5e-4: (5.6e-16, 3.4e-12),
    1e-3: (8e-15, 5.2e-11),
    2e-3: (2.5e-13, 7.4e-10),
    5e-3: (2.5e-11, 2.1e-8),
    1e-2: (8.6e-10, 2.0e-7),
    2e-2: (3.1e-8, 1.0e-5),
    5e-2: (3.9e-6, 1.5e-3),
}


@pytest.mark.parametrize("dt", FIG_2_2)
def test_fig_2_2(dt):
    r = run(dt=dt)
    phi, position = FIG_2_2[dt]
    # The two smallest steps end at a few units of the last place, where a bound is all there is.
    assert r.phi.max() == pytest.approx(phi, rel=0.03) if dt > 5e-4 else r.phi.max() < 2e-15
    assert error(r) == pytest.approx(position, rel=0.03)


@pytest.mark.parametrize("dt", [2e-3, 1e-2, 5e-2])
def test_fig_2_2_the_constraint_error_is_the_same_after_100_seconds(dt):
    assert run(duration=100.0, dt=dt).phi.max() == pytest.approx(run(dt=dt).phi.max(), rel=0.01)


def test_the_constraint_error_of_rk4_falls_with_the_fifth_power_of_the_step():
    steps = np.array([2e-3, 4e-3, 8e-3, 1.6e-2])
    phi = [run(duration=8.0, dt=dt).phi.max() for dt in steps]
    assert np.polyfit(np.log(steps), np.log(phi), 1)[0] == pytest.approx(5.0, abs=0.1)


@pytest.mark.parametrize(
    ("scheme", "steps"),
    [
        (EULER, [1e-4, 5e-5, 2.5e-5]),
        (RK4, [1e-2, 5e-3, 2.5e-3]),
        (RK4.projected(), [1e-2, 5e-3, 2.5e-3]),
        (RK8, [0.1, 0.0625, 0.05, 0.04]),
    ],
    ids=lambda x: getattr(x, "name", ""),
)
def test_order_of_convergence(scheme, steps):
    errors = [error(run(scheme, 2.0, dt)) for dt in steps]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(scheme.order, abs=0.35)


def test_energy_scaling_takes_away_most_of_the_error():
    assert error(run(RK4.energy_scaled(), 100.0)) < 0.1 * error(run(RK4, 100.0))


@pytest.mark.parametrize("tolerance", [1e-8, 1e-10, 1e-12])
def test_adaptive_steps_keep_to_their_tolerance(tolerance):
    r = run(RK8.adaptive(tolerance), dt=0.1)
    assert error(r) < 100 * tolerance
    assert r.t == pytest.approx(0.1 * np.arange(101), abs=1e-14)


def test_adaptive_steps_grow_with_the_tolerance():
    counts = [run(RK8.adaptive(tolerance), dt=0.5).steps for tolerance in (1e-12, 1e-9, 1e-6)]
    assert counts[0] > counts[1] > counts[2]


@pytest.mark.parametrize("radius", [0.001, 0.01, 0.1, 0.5, 2.0, 5.0])
@pytest.mark.parametrize("scheme", [EULER, RK4, RK8], ids=lambda s: s.name)
def test_a_start_at_any_radius_settles(radius, scheme):
    r = run(scheme, 1.0, 1e-3, start=([radius * p.LENGTH, 0.0], [0.0, 0.0]))
    assert r.phi[0] > 0.5
    assert r.phi[30:].max() < (1e-4 if scheme is EULER else 1e-13)
    assert np.abs(r.v).max() < 5.0


def test_baumgarte_keeps_the_drift_small_but_not_gone():
    drift = {s: run(s, 100.0, 1e-2).phi[-1000:].max() for s in (RK4, RK4.baumgarte(20, 20), RK4.uncorrected())}
    ours, baumgarte, uncorrected = drift.values()
    assert ours < 0.1 * baumgarte < 0.01 * uncorrected


def test_projection_leaves_no_constraint_error():
    r = run(RK4.projected(), 10.0, 5e-2)
    assert max(r.phi.max(), r.phi_dot.max()) < 1e-13


def test_every_keeps_fewer_samples_and_no_less_of_the_worst():
    full, few = run(dt=1e-2), run(dt=1e-2, every=300)
    assert few.t == pytest.approx([0.0, 3.0, 6.0, 9.0, 10.0])
    assert (few.q == full.q[[0, 300, 600, 900, 1000]]).all()
    assert few.phi.max() == full.phi.max()
    assert few.phi[2] == full.phi[301:601].max()
