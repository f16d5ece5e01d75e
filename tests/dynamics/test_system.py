"""Systems a user writes: what the library promises about them, and what it says when they are wrong."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from biped.base.errors import InputError, RunError
from biped.dynamics import EULER, RK4, RK8, ConstrainedSystem, integrate
from biped.dynamics.check import check_derivatives
from biped.dynamics.mechanisms import exercises, four_bars, pendulum, slider_crank

# --- four masses on a triangle of rods and a tail, floating free: momentum is nobody's to change ---

RODS = np.array([[0, 1], [1, 2], [2, 0], [2, 3]])
FREE_Q = np.array([0.0, 0.0, 1.0, 0.0, 0.3, 0.8, 0.9, 1.6])
LENGTHS = np.array([np.hypot(*(FREE_Q[2 * i : 2 * i + 2] - FREE_Q[2 * j : 2 * j + 2])) for i, j in RODS])


def free_mass(t, q, v, p, M):
    for i in range(8):
        M[i, i] = p[i // 2]


def no_force(t, q, v, p, Q):
    pass


def rods_phi(t, q, v, p, phi):
    for k in range(4):
        i, j = 2 * RODS[k, 0], 2 * RODS[k, 1]
        phi[k] = (q[i] - q[j]) ** 2 + (q[i + 1] - q[j + 1]) ** 2 - LENGTHS[k] ** 2


def rods_A(t, q, v, p, A):
    for k in range(4):
        i, j = 2 * RODS[k, 0], 2 * RODS[k, 1]
        for d in range(2):
            A[k, i + d] = 2 * (q[i + d] - q[j + d])
            A[k, j + d] = -A[k, i + d]


def rods_b_v(t, q, v, p, b_v):
    for k in range(4):
        i, j = 2 * RODS[k, 0], 2 * RODS[k, 1]
        b_v[k] = -2 * ((v[i] - v[j]) ** 2 + (v[i + 1] - v[j + 1]) ** 2)


FREE = ConstrainedSystem(
    n=8,
    m=4,
    mass=free_mass,
    force=no_force,
    phi=rods_phi,
    A=rods_A,
    b_v=rods_b_v,
    params=(1.0, 2.0, 0.5, 5.0),
)


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


# --- a skate on a slope: a constraint on velocities alone, with an exact solution ---


def skate_mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = M[2, 2] = 1.0


def skate_force(t, q, v, p, Q):
    Q[0] = p[0]


def skate_A(t, q, v, p, A):
    A[0, 0], A[0, 1] = np.sin(q[2]), -np.cos(q[2])


def skate_b_v(t, q, v, p, b_v):
    b_v[0] = -v[2] * (np.cos(q[2]) * v[0] + np.sin(q[2]) * v[1])


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


# --- a bead on a rod that turns as told: a constraint on time, with an exact solution ---


def bead_mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = 1.0


def bead_phi(t, q, v, p, phi):
    phi[0] = q[1] * np.cos(t) - q[0] * np.sin(t)


def bead_A(t, q, v, p, A):
    A[0, 0], A[0, 1] = -np.sin(t), np.cos(t)


def bead_b_q(t, q, v, p, b_q):
    b_q[0] = q[1] * np.sin(t) + q[0] * np.cos(t)


def bead_b_v(t, q, v, p, b_v):
    b_v[0] = 2 * (v[1] * np.sin(t) + v[0] * np.cos(t)) + q[1] * np.cos(t) - q[0] * np.sin(t)


BEAD = ConstrainedSystem(
    n=2, m=1, mass=bead_mass, force=no_force, phi=bead_phi, A=bead_A, b_q=bead_b_q, b_v=bead_b_v, name="bead"
)


def test_a_bead_on_a_turning_rod_flies_out_as_cosh():
    r = integrate(BEAD, [1.0, 0.0], [0.0, 1.0], duration=3.0, dt=1e-2, scheme=RK8)
    exact = np.cosh(r.t)[:, None] * np.stack((np.cos(r.t), np.sin(r.t)), 1)
    np.testing.assert_allclose(r.q, exact, rtol=0, atol=1e-12)


def test_starting_later_is_the_same_motion_later():
    a = integrate(BEAD, [1.0, 0.0], [0.0, 1.0], duration=2.0, dt=1e-2)
    b = integrate(BEAD, a.q[100], a.v[100], t=1.0, duration=1.0, dt=1e-2)
    np.testing.assert_allclose(b.q, a.q[100:], atol=1e-9)


# --- functions that agree, and functions that do not ---


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


# --- what is refused, and how ---

START = {"q": [1.0, 0.0], "v": [0.0, 0.0], "duration": 1.0, "dt": 1e-2}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": [1.0]}, r"q must have shape \(2,\), not \(1,\)"),
        ({"v": [[0.0, 0.0]]}, r"v must have shape \(2,\), not \(1, 2\)"),
        ({"q": ["a", "b"]}, "q must be 2 numbers"),
        ({"q": [np.nan, 0.0]}, "q must be finite"),
        ({"v": [np.inf, 0.0]}, "v must be finite"),
        ({"dt": 0.0}, "dt must be positive"),
        ({"dt": -1e-3}, "dt must be positive"),
        ({"dt": np.nan}, "dt must be positive"),
        ({"dt": 10.0}, "do not go into"),
        ({"duration": -1.0}, "duration must be positive"),
        ({"duration": np.inf}, "duration must be positive"),
        ({"dt": 1e-300}, "do not go into"),
        ({"t": 1e20}, "do not go into"),
        ({"dt": 1e-9, "duration": 1000.0}, "do not fit in memory"),
        ({"every": 0}, "every must be at least 1"),
        ({"every": 2.5}, "every must be a whole number"),
        ({"rank": 0.5}, "rank must be a whole number"),
        ({"rank": "1"}, "rank must be a number, not '1'"),
        ({"duration": "1"}, "duration must be a number"),
        ({"dt": "a"}, "dt must be a number"),
        ({"q": [1j, 0.0]}, "q must be finite"),
        ({"scheme": RK4.energy_scaled()}, None),
    ],
)
def test_inputs_that_make_no_sense_are_refused(change, message):
    options = {**START, **change}
    system, q, v = pendulum.pendulum(), options.pop("q"), options.pop("v")
    if message is None:
        system, message = replace(system, potential=BEAD.potential), "needs a potential"
    with pytest.raises(InputError, match=message):
        integrate(system, q, v, **options)


def test_what_is_no_system_or_scheme_is_refused():
    with pytest.raises(InputError, match="needs a ConstrainedSystem"):
        integrate(bead_mass, [1.0, 0.0], [0.0, 0.0], duration=1.0, dt=0.1)
    with pytest.raises(InputError, match="the scheme must be EULER, RK4, RK8 or derived from one, not 'RK8'"):
        integrate(pendulum.pendulum(), **START, scheme="RK8")


def test_schemes_refuse_what_makes_no_sense():
    with pytest.raises(InputError, match="no embedded pair"):
        RK4.adaptive(1e-6)
    for tolerance in (-1e-6, np.nan, 1e-25):
        with pytest.raises(InputError, match="tolerances must be finite and at least"):
            RK8.adaptive(tolerance)
    with pytest.raises(InputError, match="alpha and beta"):
        RK4.baumgarte(-1.0, 5.0)


@pytest.mark.parametrize(("n", "m"), [(0, 0), (2, -1)])
def test_sizes_that_make_no_sense_are_refused(n, m):
    with pytest.raises(InputError, match="n must be at least 1"):
        ConstrainedSystem(n=n, m=m, mass=bead_mass, force=no_force)


def test_constraints_without_functions_are_refused():
    with pytest.raises(InputError, match="need the functions phi, A and b_v"):
        ConstrainedSystem(n=2, m=1, mass=bead_mass, force=no_force)


def test_sizes_and_parameters_that_are_no_numbers_are_refused():
    with pytest.raises(InputError, match=r"n must be a whole number, not 2\.0"):
        ConstrainedSystem(n=2.0, m=0, mass=bead_mass, force=no_force)
    with pytest.raises(InputError, match="params must be numbers"):
        integrate(pendulum.pendulum().with_params(("a", 1.0, 9.81)), **START)


def first_of_two(t, q, v, p, out):
    out[1] = q[0]


def without_out(t, q, v, p):
    return q


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"phi": first_of_two}, r"the function phi goes beyond its arrays: .* out 1"),
        ({"params": (1.0, 1.0)}, r"the function force goes beyond its arrays: .* p 2"),
        ({"force": without_out}, r"the function force must take \(t, q, v, p, out\)"),
    ],
)
def test_a_function_that_goes_beyond_its_arrays_is_named(change, message):
    """Compiled it would read and write whatever lies there."""
    with pytest.raises(InputError, match=message):
        integrate(replace(pendulum.pendulum(), **change), **START)


@pytest.mark.parametrize("change", [{"events": ("low",)}, {"event": no_force}, {"powers": ("a",)}, {"power": no_force}])
def test_events_and_powers_need_function_and_names(change):
    with pytest.raises(InputError, match="need each other"):
        replace(pendulum.pendulum(), **change)


def test_differences_of_a_state_of_another_size_are_refused():
    with pytest.raises(InputError, match=r"q must have shape \(2,\)"):
        check_derivatives(pendulum.pendulum(), 0.0, [1.0, 2.0, 3.0], [1.0, 2.0])


def never(t, q, v, p, out):
    if t > 0.3:
        out[0] = np.nan


def never_a_row(t, q, v, p, out):
    out[0, 0], out[0, 1] = q[0], q[1]
    if t > 0.3:
        out[0, 0] = np.nan


@pytest.mark.parametrize("scheme", [RK4, RK8, RK8.adaptive(1e-8)], ids=lambda s: s.name)
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A": never_a_row}, r"t = 0\.3\d* s (A is not finite|no step passes)"),
        ({"phi": never}, r"t = 0\.3\d* s (phi is not finite|no step passes)"),
        ({"b_v": never}, r"t = 0\.3\d* s (b_v is not finite|no step passes)"),
        ({"event": never, "events": ("low",)}, r"t = 0\.3\d* s the event low is not a number"),
    ],
    ids=["A", "phi", "b_v", "event"],
)
def test_what_is_not_a_number_is_named(change, message, scheme):
    """A row of A that is none was taken for a dependent one, and an event that is none never happened."""
    with pytest.raises(RunError, match=message):
        integrate(replace(pendulum.pendulum(), **change), **{**START, "dt": 1e-2}, scheme=scheme)


def two_lengths(t, q, v, p, out):
    out[0] = 0.5 * (q[0] ** 2 + q[1] ** 2 - 1.0)
    out[1] = 0.5 * (q[0] ** 2 + q[1] ** 2 - 1.21)


def twice(t, q, v, p, out):
    out[0, 0] = out[1, 0] = q[0]
    out[0, 1] = out[1, 1] = q[1]


def twice_b_v(t, q, v, p, out):
    out[0] = out[1] = -(v[0] ** 2 + v[1] ** 2)


@pytest.mark.parametrize(
    "change",
    [{"m": 2, "phi": two_lengths, "A": twice, "b_v": twice_b_v}, {"phi": two_lengths, "m": 2, "A": no_force}],
    ids=["two lengths of one rod", "rows of zeros"],
)
def test_rows_that_contradict_each_other_are_refused(change):
    """The best of what cannot be was simulated without a word."""
    with pytest.raises(InputError, match="the constraints cannot all be satisfied"):
        integrate(replace(pendulum.pendulum(), **change), **START)


def negative_mass(t, q, v, p, M):
    M[0, 0], M[1, 1] = 1.0, 0.6 - t


def lopsided_mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = 1.0
    M[0, 1] = 0.1


def breaking_force(t, q, v, p, Q):
    Q[1] = np.sqrt(0.5 - t)


def test_a_mass_matrix_that_turns_indefinite_is_said_when_and_how():
    with pytest.raises(
        RunError, match=r"pendulum, RK4.* at t = 0\.6\d* s .*not positive definite: smallest eigenvalue"
    ):
        integrate(replace(pendulum.pendulum(), mass=negative_mass), **START)


def test_a_mass_matrix_that_is_not_symmetric_is_said():
    with pytest.raises(InputError, match=r"must be symmetric, but M\[0,1\] = 0.1"):
        integrate(replace(pendulum.pendulum(), mass=lopsided_mass), **START)


def test_a_force_that_is_not_a_number_is_named():
    with pytest.raises(RunError, match=r"t = 0\.50\d* s Q is not finite: Q = \[ *0\. +nan\]"):
        integrate(replace(pendulum.pendulum(), force=breaking_force), **START)


@pytest.mark.parametrize("scheme", [EULER, RK4, RK8], ids=lambda s: s.name)
@pytest.mark.parametrize("dt", [0.5, 2.0, 20.0])
def test_an_absurd_step_ends_with_an_error(scheme, dt):
    with pytest.raises(RunError, match=r"does not settle|not finite"):
        integrate(pendulum.pendulum(), [1.0, 0.0], [0.0, 0.0], duration=30 * dt, dt=dt, scheme=scheme)


def noise(t, q, v, p, Q):
    Q[1] = 1e6 * np.sin(1e18 * (q[1] + t))


def test_a_motion_no_step_can_follow_ends_with_an_error():
    with pytest.raises(RunError, match="no step passes the error test"):
        integrate(replace(pendulum.pendulum(), force=noise), **START, scheme=RK8.adaptive(1e-12))


def test_adaptive_steps_stop_where_a_force_ends():
    with pytest.raises(RunError, match=r"t = 0\.50\d* s (Q is not finite|no step passes)"):
        integrate(replace(pendulum.pendulum(), force=breaking_force), **START, scheme=RK8.adaptive(1e-9))


def uncompilable(t, q, v, p, Q):
    Q[1] = -9.81 * (os.getpid() > 0)


def test_a_function_numba_cannot_compile_is_said_and_runs_as_python():
    system = replace(pendulum.pendulum(), force=uncompilable)
    with pytest.raises(InputError, match="the function force cannot be compiled"):
        integrate(system, **START)
    r = integrate(replace(system, compiled=False), **START)
    compiled = integrate(pendulum.pendulum(), **START)
    np.testing.assert_allclose(r.q, compiled.q, atol=1e-14)


def test_other_parameters_compile_nothing_again():
    system = pendulum.pendulum()
    other = system.with_params((1.0, 2.0, 9.81))
    assert all(a is b for a, b in zip(system.functions, other.functions, strict=True))
    r = integrate(other, [2.0, 0.0], [0.0, 0.0], duration=1.0, dt=1e-3)
    np.testing.assert_allclose(r.q, pendulum.exact(r.t, length=2.0), atol=1e-10)


def test_energy_of_a_system_without_a_potential_is_refused():
    with pytest.raises(InputError, match="energies need a potential"):
        BEAD.energy(0.0, np.ones(2), np.ones(2))


SNIPPET = """
import numpy as np
from biped.dynamics import RK8, integrate
from biped.dynamics.mechanisms import four_bars as f
r = integrate(f.four_bars(), *f.CONSISTENT, duration=1.5, dt=1e-2, scheme=RK8)
print(r.steps, r.rank.max(), *r.q[-1])
"""


def test_the_kernels_run_as_plain_python_too():
    runs = [
        subprocess.run(
            [sys.executable, "-c", SNIPPET],
            env={**os.environ, "NUMBA_DISABLE_JIT": disable},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        for disable in ("0", "1")
    ]
    assert runs[0][:2] == runs[1][:2]
    np.testing.assert_allclose(*np.array(runs)[:, 2:].astype(float), rtol=0, atol=1e-12)
