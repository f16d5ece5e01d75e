"""Constraints that depend on each other only on Φ = 0, and positions where a rank is missing: told apart."""

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import RK4, RK8, integrate
from biped.dynamics.check import check_derivatives
from biped.dynamics.mechanisms import four_bars
from biped.dynamics.mechanisms import overconstrained as o
from biped.dynamics.mjcf import load
from biped.dynamics.rank import structural_rank


@pytest.fixture
def bricard(tmp_path):
    path = tmp_path / "bricard.xml"
    path.write_text(o.bricard_mjcf(), encoding="utf-8")
    return load(path)


@pytest.mark.parametrize(
    ("scheme", "dt"), [(RK4, 5e-3), (RK8, 2e-2), (RK8.adaptive(1e-9), 0.1)], ids=lambda x: getattr(x, "name", "")
)
def test_bricard_s_six_bar_with_all_six_rows_keeps_its_energy(bricard, scheme, dt):
    r = integrate(bricard.system, bricard.q, bricard.v, duration=10.0, dt=dt, scheme=scheme)
    assert (r.rank == 4).all()
    assert r.structural_rank == 4
    assert np.abs(r.energy - r.energy[0]).max() < 1e-6
    assert np.abs(r.q).max() > 0.5  # it does move


def test_a_cap_says_the_same_and_a_wrong_one_does_not_fit(bricard):
    given = integrate(bricard.system, bricard.q, bricard.v, duration=0.5, dt=1e-2, rank=4)
    found = integrate(bricard.system, bricard.q, bricard.v, duration=0.5, dt=1e-2)
    assert (given.q == found.q).all()
    with pytest.raises(InputError, match="rank must be from 0 to 5, not 6"):
        integrate(bricard.system, bricard.q, bricard.v, duration=0.5, dt=1e-2, rank=6)


@pytest.mark.parametrize(
    ("mechanism", "rank", "rows"),
    [(o.bricard(), 59, 60), (o.bennett(), 35, 38), (o.parallelograms(), 15, 16), (o.parallelograms(3), 39, 42)],
    ids=lambda x: getattr(x, "name", ""),
)
def test_other_over_constrained_mechanisms(mechanism, rank, rows):
    system = mechanism.system
    e = system.evaluate(0.0, mechanism.q, mechanism.v)
    assert np.abs(e.phi).max() < 1e-14
    assert system.m == rows
    rng = np.random.default_rng(3)
    check_derivatives(system, 0.0, rng.normal(size=system.n), rng.normal(size=system.n))
    r = integrate(system, mechanism.q, mechanism.v, duration=1.0, dt=5e-3, scheme=RK8)
    assert r.structural_rank == rank
    assert np.abs(r.energy - r.energy[0]).max() < 1e-6
    assert r.phi.max() < 1e-8


def test_a_parallelogram_with_a_bar_too_many_falls_as_its_crank_does():
    """Two cranks and two couplers of 1 kg: (2/3 + 1 + 1/4) θ̈ = −g (1 + 1 + 1/2) cos θ."""
    mechanism = o.parallelograms()
    r = integrate(mechanism.system, mechanism.q, mechanism.v, duration=2.0, dt=1e-2, scheme=RK8)
    angle = mechanism.angle(r.q, mechanism.bodies[0])
    rate = r.q[:, 2] * r.v[:, 3] - r.q[:, 3] * r.v[:, 2]
    inertia, weight = 2 / 3 + 1 + 1 / 4, 9.81 * 2.5
    np.testing.assert_allclose(0.5 * inertia * (rate**2 - 1.0), weight * (1 - np.sin(angle)), atol=1e-6)
    assert angle[-1] < -np.pi / 2  # through the flat position, where it is singular, and beyond
    np.testing.assert_allclose(mechanism.angle(r.q, mechanism.bodies[1]), angle, atol=1e-9)


def test_the_rank_of_a_singular_start_is_that_of_its_neighbours():
    system = four_bars.four_bars(3)
    for angle in (0.0, 1e-14, 1e-8, 1e-3, 1.0):
        q, v = four_bars.start(angle, 1.0, 3)
        assert structural_rank(system, 0.0, q, v)[0] == 7


def test_a_start_off_the_constraints_does_not_hide_what_is_redundant(bricard):
    rng = np.random.default_rng(1)
    for off in (1e-9, 1e-6, 1e-3, 1e-2):
        q = bricard.q + off * rng.normal(size=5)
        assert structural_rank(bricard.system, 0.0, q, bricard.v)[0] == 4
    q = bricard.q + 1e-3 * rng.normal(size=5)
    r = integrate(bricard.system, q, bricard.v, duration=1.0, dt=1e-2, scheme=RK8)
    assert r.phi[10:].max() < 1e-9
