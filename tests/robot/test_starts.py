"""Starts that deviate, of robots of any kind: no joint is further beyond its stop than stops give way."""

import mujoco
import numpy as np
import pytest

from biped.ensemble.plan import Plan
from biped.scenario.keys import GIVES_WAY
from biped.scenario.reading import read_scenario

RUNS = 40


@pytest.mark.parametrize("name", ["spatial/own", "any/plane"])
def test_no_joint_of_a_deviating_start_is_far_beyond_its_stop(name):
    plan = Plan(read_scenario(name, ["start.jitter=0.1", f"randomise.runs={RUNS}", "sweep={}"]))
    before = Plan(read_scenario(name, ["start.jitter=0.0", "sweep={}"])).run(0).q
    model = plan.run(0).visual_model
    stopped = np.flatnonzero((model.jnt_limited > 0) & (model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE))
    assert len(stopped) >= 2
    places, (low, high) = model.jnt_qposadr[stopped], model.jnt_range[stopped].T
    q = np.array([plan.run(i).q[places] for i in range(RUNS)])
    least, most = np.minimum(low - GIVES_WAY, before[places]), np.maximum(high + GIVES_WAY, before[places])
    assert (q >= least).all()
    assert (q <= most).all()
    assert ((q == least) | (q == most)).any()
    assert np.abs(q - before[places]).max() > 0.2
