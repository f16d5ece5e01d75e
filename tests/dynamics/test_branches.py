"""Starts in a singular position: the ones no motion goes on from are refused, by what they are."""

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.dynamics import RK4, RK8, integrate
from biped.dynamics.bodies import GROUND, Plane
from biped.dynamics.mechanisms import four_bars

SCHEMES = [(RK8.adaptive(1e-9), None), (RK8, 0.01), (RK4, 0.01)]


def stretched(gravity):
    """A rod on a hinge, held at its tip by a stay in line with it: it cannot move, but A v = 0 would let it turn."""
    plane = Plane(name="stretched", gravity=gravity)
    rod = plane.body("rod", mass=1.0, inertia=1 / 12, at=(0.0, 0.0), angle=0.0, centre=(0.5, 0.0))
    plane.hinge("hinge", GROUND, (0.0, 0.0), rod, (0.0, 0.0))
    plane.rod("stay", rod, (1.0, 0.0), GROUND, (2.0, 0.0))
    return plane


def run(system, q, v, scheme, dt):
    return integrate(system, q, v, duration=0.5, dt=dt, sampling=0.1, scheme=scheme)


@pytest.mark.parametrize(("scheme", "dt"), SCHEMES)
@pytest.mark.parametrize("gravity", [(0.0, 0.0), (9.81, 0.0)])
def test_a_locked_mechanism_stays_under_a_load_that_it_can_bear(scheme, dt, gravity):
    plane = stretched(gravity)
    r = run(plane.system, plane.q, plane.v, scheme, dt)
    assert np.abs(r.q - plane.q).max() < 1e-12
    assert np.abs(r.v).max() < 1e-12


@pytest.mark.parametrize(("scheme", "dt"), SCHEMES)
def test_a_load_that_no_finite_force_holds_is_an_error(scheme, dt):
    plane = stretched((0.0, -9.81))
    with pytest.raises(InputError, match=r"stretched: the start is at rest in a singular position.*no finite"):
        run(plane.system, plane.q, plane.v, scheme, dt)


def test_a_hair_from_the_locked_position_the_start_is_put_onto_it():
    """Off the constraints by 1e-6 it is the same start."""
    plane = stretched((0.0, -9.81))
    q = plane.q + 1e-7 * np.array([0.0, 0.0, 1.0, -1.0])
    with pytest.raises(InputError, match="at rest in a singular position"):
        run(plane.system, q, plane.v, *SCHEMES[0])


def test_a_velocity_that_a_locked_mechanism_cannot_have_is_an_error():
    plane = stretched((0.0, 0.0))
    with pytest.raises(InputError, match="a velocity that no motion has there"):
        run(plane.system, plane.q, np.array([0.0, 0.0, 0.0, 1.0]), *SCHEMES[0])


def test_four_bars_lying_flat_go_on_with_the_velocity_of_a_branch_and_not_from_rest():
    system = four_bars.four_bars()
    q, v = four_bars.start(0.0, 1.0)
    r = run(system, q, v, *SCHEMES[0])
    assert np.abs(r.energy - r.energy[0]).max() < 1e-7
    with pytest.raises(InputError, match="which branch it takes is not determined"):
        run(system, q, 0.0 * v, *SCHEMES[0])
    one = v.copy()
    one[5] *= -2.0  # A v = 0 still, but the last joint turns otherwise than by any parallelogram or its reverse
    with pytest.raises(InputError, match="a velocity that no motion has there"):
        run(system, q, one, *SCHEMES[0])


def test_an_overruled_rank_is_taken_at_its_word():
    plane = stretched((0.0, -9.81))
    r = integrate(plane.system, plane.q, plane.v, duration=0.01, dt=0.01, scheme=RK8, rank=3)
    assert r.structural_rank == 3
