"""Andrews' squeezing mechanism, built from its parameters, against the published solution."""

import numpy as np
import pytest

from biped.dynamics import RK8, integrate
from biped.dynamics.mechanisms.squeezer import DURATION, PUBLISHED, squeezer


def test_the_start_closes_all_loops():
    s = squeezer()
    e = s.plane.system.evaluate(0.0, s.plane.q, s.plane.v)
    assert np.abs(e.phi).max() < 1e-15
    assert (s.plane.system.n, s.plane.system.m) == (28, 27)


@pytest.mark.parametrize(("scheme", "dt"), [(RK8, 1e-4), (RK8.adaptive(1e-11), 3e-4)], ids=["fixed", "adaptive"])
def test_it_ends_where_the_published_solution_does(scheme, dt):
    s = squeezer()
    r = integrate(s.plane.system, s.plane.q, s.plane.v, duration=DURATION, dt=dt, scheme=scheme)
    for name, angle in PUBLISHED.items():
        assert s.plane.angle(r.q, getattr(s, name))[-1] == pytest.approx(angle, abs=1e-7), name
    turned = s.plane.angle(r.q, s.crank)
    np.testing.assert_allclose(r.work[:, 2], 0.033 * (turned - turned[0]), atol=1e-9)
    np.testing.assert_allclose(r.energy - r.energy[0], r.work[:, 2], atol=1e-9)


def test_accelerations_and_joint_forces_at_the_start_are_the_published_ones():
    """Initial values of the Test Set (andrews.f): β̈, θ̈, and the multipliers of the loop through the rocker."""
    s = squeezer()
    motion = integrate(s.plane.system, s.plane.q, s.plane.v, duration=1e-5, dt=1e-5, scheme=RK8)
    state, acceleration = motion.q[0], motion.acceleration[0]

    def turn(body):
        c = body.first + 2
        return state[c] * acceleration[c + 1] - state[c + 1] * acceleration[c]

    crank, tie = s.plane.bodies[:2]
    assert turn(crank) == pytest.approx(14222.4439199541387, rel=1e-10)
    assert turn(tie) - turn(crank) == pytest.approx(-10666.8329399655854, rel=1e-10)
    ends = {joint.name: joint for joint in s.plane.joints}
    force, moment = s.plane.joint_forces(motion, ends["E rocker"])
    np.testing.assert_allclose(force[0], (-98.5668703962410896, 6.12268834425566265), rtol=1e-10)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12)
    for name in ("E lower", "E upper"):
        np.testing.assert_allclose(s.plane.joint_forces(motion, ends[name])[0][0], 0.0, atol=1e-10)
