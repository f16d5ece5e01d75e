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
