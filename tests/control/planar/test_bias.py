"""The tick's bias forces against Pinocchio on the same model file."""

import numpy as np
import pinocchio
import pytest

from biped.scenario.devices import Actuation
from biped.scenario.keys import Scenario
from biped.scenario.world import Ground
from tests.ticks import Bench, states


@pytest.mark.parametrize("slope", [0.0, -7.0])
def test_bias_forces_are_pinocchios(slope):
    bench = Bench(Scenario(ground=Ground(slope=slope), actuation=Actuation(torque_limit=1e9)))
    model = bench.model
    data = model.createData()
    for q, v in states(100, seed=8):
        q[0] = 50.0  # far along the road
        bench.tick(q, v)
        h = pinocchio.nonLinearEffects(model, data, q, v)
        np.testing.assert_allclose(bench.c["tick"]["h"], h, rtol=0, atol=1e-12 * np.abs(h).max())


def test_without_the_release_test_no_bias_forces_are_computed():
    bench = Bench(Scenario(actuation=Actuation(contacts="touching")))
    bench.c["tick"]["h"] = np.nan
    for q, v in states(5, seed=9):
        assert np.isfinite(bench.tick(q, v)).all()
        assert np.isnan(bench.c["tick"]["h"]).all()
