"""What a motion has besides q and v: accelerations, multipliers, work, events, and a b_v that was not given."""

from dataclasses import replace

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import RK4, RK8, ConstrainedSystem, integrate
from biped.dynamics.mechanisms import exercises, four_bars, pendulum, slider_crank
from biped.dynamics.system import _nothing

# --- accelerations and multipliers ---


@pytest.mark.parametrize(
    ("system", "start"),
    [
        (slider_crank.slider_crank(), slider_crank.CONSISTENT),
        (four_bars.four_bars(), four_bars.CONSISTENT),
        (four_bars.four_bars(20), four_bars.start(np.pi / 2, -1.0, 20)),
    ],
    ids=lambda x: getattr(x, "name", ""),
)
def test_multipliers_are_those_of_the_whole_linear_system(system, start):
    r = integrate(system, *start, duration=1.0, dt=1e-2, sampling=0.1, scheme=RK8)
    for k in range(len(r.t)):
        e = system.evaluate(r.t[k], r.q[k], r.v[k])
        K = np.block([[e.M, -e.A.T], [e.A, np.zeros((system.m, system.m))]])
        solved = np.linalg.solve(K, np.concatenate((e.Q, e.b_v)))
        n, size = system.n, np.abs(solved[system.n :]).max()
        np.testing.assert_allclose(r.acceleration[k], solved[:n], rtol=0, atol=1e-10 * np.abs(solved[:n]).max())
        np.testing.assert_allclose(r.multipliers[k], solved[n:], rtol=0, atol=1e-10 * size)
        np.testing.assert_allclose(r.reactions.force[k], e.A.T @ solved[n:], atol=1e-8)


def test_redundant_rows_share_their_force():
    system = exercises.exercise(3)
    r = integrate(system, exercises.STARTS[3], np.zeros(9), duration=0.1, dt=1e-2)
    e = system.evaluate(r.t[-1], r.q[-1], r.v[-1])
    np.testing.assert_allclose(e.M @ r.acceleration[-1], e.Q + e.A.T @ r.multipliers[-1], atol=1e-9)
    assert "10 constraints of rank 9" in r.notes[0]


def test_energies_are_those_of_the_states():
    system = pendulum.pendulum()
    r = integrate(system, *pendulum.CONSISTENT, duration=1.0, dt=1e-2, scheme=RK8)
    np.testing.assert_allclose(r.kinetic, 0.5 * (r.v**2).sum(axis=1))
    np.testing.assert_allclose(r.potential, 9.81 * r.q[:, 1])
    np.testing.assert_allclose(r.energy, 0.0, atol=1e-10)


# --- work ---


def drag(t, q, v, p, Q):
    Q[0] = -0.3 * v[0]
    Q[1] = -9.81 - 0.3 * v[1]


def powers(t, q, v, p, out):
    out[0] += -9.81 * v[1]  # adds to the zeros that are promised
    out[1] = -0.3 * (v[0] ** 2 + v[1] ** 2)


@pytest.mark.parametrize(("scheme", "bound"), [(RK4, 1e-6), (RK8, 1e-12), (RK8.adaptive(1e-10), 1e-8)])
def test_the_work_of_every_force_adds_up_to_the_energy(scheme, bound):
    system = replace(pendulum.pendulum(), force=drag, power=powers, powers=("weight", "drag"))
    r = integrate(system, *pendulum.CONSISTENT, duration=3.0, dt=1e-2, scheme=scheme)
    np.testing.assert_allclose(r.work[:, 0], r.potential[0] - r.potential, atol=bound)
    np.testing.assert_allclose(r.work[:, 1], r.energy - r.energy[0], atol=bound)
    assert r.work[-1, 1] < -1.0


# --- events ---


def lowest_and_late(t, q, v, p, out):
    out[0] = q[0]
    out[1] = t - 50.0


@pytest.mark.parametrize("scheme", [RK4, RK8, RK8.adaptive(1e-11)], ids=lambda s: s.name)
def test_an_event_ends_the_motion_where_it_happens(scheme):
    system = replace(pendulum.pendulum(), event=lowest_and_late, events=("lowest", "late"))
    r = integrate(system, *pendulum.CONSISTENT, duration=100.0, dt=1e-2, scheme=scheme)
    quarter = 1.8540746773013719 / np.sqrt(9.81)  # K(√½)/ω: a quarter of the period
    assert r.event == "lowest"
    assert r.t[-1] == pytest.approx(quarter, abs=1e-7 if scheme is RK4 else 1e-10)
    np.testing.assert_allclose(r.q[-1], [0.0, -1.0], atol=1e-12)
    assert len(r.t) == len(r.q) < 100


def test_without_an_event_the_motion_runs_to_its_end():
    r = integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=1.0, dt=1e-2)
    assert r.event is None
    assert r.t[-1] == pytest.approx(1.0)


# --- a b_v that was not given ---


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize(
    "system",
    [pendulum.pendulum(), slider_crank.slider_crank(), four_bars.four_bars(), exercises.exercise(2)],
    ids=lambda s: s.name,
)
def test_it_is_derived_to_full_accuracy(system, compiled):
    derived = replace(system, b_v=_nothing, compiled=compiled)
    rng = np.random.default_rng(8)
    for speed in (0.0, 1e-3, 1.0, 100.0):
        q, v = rng.normal(size=system.n), speed * rng.normal(size=system.n)
        given, found = (s.evaluate(0.3, q, v).b_v for s in (system, derived))
        np.testing.assert_allclose(found, given, rtol=0, atol=1e-10 * max(1.0, np.abs(given).max()))


def test_the_motion_says_that_it_was_derived():
    system = replace(pendulum.pendulum(), b_v=_nothing)
    r = integrate(system, *pendulum.CONSISTENT, duration=1.0, dt=1e-3)
    np.testing.assert_allclose(r.q, pendulum.exact(r.t), atol=1e-10)
    assert "b_v was not given" in r.notes[0]
    assert not integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=0.1, dt=1e-2).notes


# --- steps and samples ---


def test_sampling_and_step_are_named_apart():
    every = integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=1.0, dt=1e-3, every=100)
    named = integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=1.0, dt=1e-3, sampling=0.1)
    assert (named.q == every.q).all()
    adaptive = RK8.adaptive(1e-9)
    short = integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=1.0, dt=1e-3, sampling=0.1, scheme=adaptive)
    free = integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=1.0, sampling=0.1, scheme=adaptive)
    np.testing.assert_allclose(short.t, free.t)
    assert short.steps >= 1000 > free.steps


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "give the step dt"),
        ({"dt": 1e-3, "sampling": 0.1, "every": 2}, "not both"),
        ({"dt": 3e-3, "sampling": 0.1}, "must be a multiple of dt"),
        ({"sampling": -1.0}, "sampling must be positive"),
    ],
)
def test_what_makes_no_sense_is_said(options, message):
    with pytest.raises(InputError, match=message):
        integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=1.0, **options)


# --- many coordinates, few entries ---


def test_entries_that_turn_up_late_are_noticed():
    """A coupling that no state near the start shows: the run must not overlook it."""

    def mass(t, q, v, p, M):
        for i in range(40):
            M[i, i] = 1.0
        if t > 0.5:
            M[0, 1] = M[1, 0] = 0.5

    def force(t, q, v, p, Q):
        Q[0] = 1.0

    def A(t, q, v, p, out):
        for i in range(10):
            out[i, 10 + i] = 1.0

    def b_v(t, q, v, p, out):
        pass

    system = ConstrainedSystem(n=40, m=10, mass=mass, force=force, A=A, b_v=b_v, name="late")
    r = integrate(system, np.zeros(40), np.zeros(40), duration=1.0, dt=1e-2)
    assert r.v[50, 0] == pytest.approx(0.5, abs=1e-12)
    # From then on (1, ½; ½, 1) v̇ = (1, 0): 4/3 and −2/3.
    assert r.v[-1, :2] == pytest.approx([0.5 + 0.5 * 4 / 3, -1 / 3], abs=2e-2)


def test_a_large_chain_gives_what_full_matrices_give(monkeypatch):
    system, start = four_bars.four_bars(12), four_bars.start(np.pi / 2, -1.0, 12)
    sparse = integrate(system, *start, duration=3.0, dt=1e-2, scheme=RK8)
    monkeypatch.setattr("biped.dynamics.pattern.LEAST_SIZE", 10**6)
    full = integrate(system, *start, duration=3.0, dt=1e-2, scheme=RK8)
    np.testing.assert_allclose(sparse.q, full.q, atol=1e-8)
    exact = integrate(four_bars.trusted(12), [np.pi / 2], [-1.0], duration=3.0, dt=1e-2, scheme=RK8)
    np.testing.assert_allclose(sparse.q[:, -2], 12 + np.cos(exact.q[:, 0]), atol=1e-7)
