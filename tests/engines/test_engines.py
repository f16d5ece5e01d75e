"""The list of engines: each is found by its name, and one more is two files."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.ensemble.campaign import run_one
from biped.scenario.engines import ENGINES, Engine
from biped.studies.run import plan_of


@pytest.mark.parametrize("name", ENGINES)
def test_every_engine_of_the_list_is_there(name):
    assert find_spec(ENGINES[name].place) is not None
    assert plan_of("upright/own", [f"engine={name}"]).scenario.engine == name


def test_an_unknown_engine_is_named_with_those_that_there_are():
    with pytest.raises(
        InputError, match=r"engine: expected one of mujoco, home, drake, got 'drak'; did you mean 'drake'"
    ):
        plan_of("upright/own", ["engine=drak"])


def test_a_toy_engine_is_an_engine(monkeypatch):
    monkeypatch.setitem(ENGINES, "toy", Engine("tests.engines.toy", "nothing holds it", any_robot=False))
    trajectory, row = run_one(plan_of("upright/own", ["engine=toy", "duration=1.0"]), 0)
    assert (row.end, row.walked) == ("fell", False)
    fallen = trajectory.com[-1, 2] - trajectory.com[0, 2] - trajectory.time[-1] * trajectory.com_velocity[0, 2]
    # Semi-implicit Euler's free fall is a step ahead.
    assert fallen == pytest.approx(
        -0.5 * 9.81 * trajectory.time[-1] * (trajectory.time[-1] + trajectory.tick), rel=1e-3
    )
    assert not np.any(trajectory.ground_force)
    with pytest.raises(InputError, match="'toy' has seven links"):
        plan_of("spatial/own", ["engine=toy"])
