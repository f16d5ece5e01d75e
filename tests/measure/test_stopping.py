"""How far a stop takes: from the first change on, and only where it ends in a stand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from biped.engines.planar.mujoco import simulate
from biped.measure.metrics import assess, measure
from biped.studies.run import plan_of
from tests.runs import made


def test_a_stop_has_a_distance():
    run = plan_of("standard/stop", []).run(0)
    t, numbers = assess(simulate(run), run.scenario.interval)
    assert numbers["stood"] == 1
    told = round(4.0 / t.tick)  # when the first of its changes begins
    assert t.changes[0] == 4.0
    assert numbers["stopping_distance"] == t.q[-1, 0] - t.q[told, 0]
    assert 0.5 < numbers["stopping_distance"] < 5.0
    kept = assess(t.last(11.0), run.scenario.interval).numbers  # what is kept of a failure begins later
    assert kept["stopping_distance"] == pytest.approx(numbers["stopping_distance"], abs=1e-9)


def test_a_walk_that_goes_on_has_none():
    assert math.isnan(measure(made("walk"), (0.5, 2.0))["stopping_distance"])
    assert math.isnan(measure(replace(made("walk"), changes=(1.0,)), (0.5, 2.0))["stopping_distance"])
