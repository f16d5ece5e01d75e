"""What is no system, no scheme or no motion is refused before anything moves, and said how."""

from dataclasses import replace

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import RK4, RK8, ConstrainedSystem, integrate
from biped.dynamics.check import check_derivatives
from biped.dynamics.mechanisms import pendulum
from tests.dynamics.systems import BEAD, START, bead_mass, no_force


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


def lopsided_mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = 1.0
    M[0, 1] = 0.1


def test_a_mass_matrix_that_is_not_symmetric_is_said():
    with pytest.raises(InputError, match=r"must be symmetric, but M\[0,1\] = 0.1"):
        integrate(replace(pendulum.pendulum(), mass=lopsided_mass), **START)


def test_energy_of_a_system_without_a_potential_is_refused():
    with pytest.raises(InputError, match="energies need a potential"):
        BEAD.energy(0.0, np.ones(2), np.ones(2))
