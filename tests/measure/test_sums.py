"""The compiled pass over rows against whole arrays at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from biped.measure.metrics import assess, measure, span_of
from biped.measure.trajectory import Trajectory
from biped.measure.verdict import first_too_fast
from biped.robot.robot import with_tree
from tests.measure import referee
from tests.runs import SCENARIOS, made, mirrored


def damped(t: Trajectory) -> Trajectory:
    return replace(t, robot=with_tree(t.robot, t.tree._replace(damping=np.arange(6.0))))


RUNS = {
    **{name: lambda name=name: made(name) for name in SCENARIOS},
    "mirrored": lambda: mirrored(made("pushed")),
    "damped": lambda: damped(made("walk")),
    "at its limits": lambda: replace(made("walk"), torque_limit=(60.0, 30.0, 5.0, 60.0, 30.0, 5.0)),
    "one row": lambda: made("walk").last(0.001),
    "two rows": lambda: made("walk").last(0.002),
    "not to be pushed": lambda: replace(made("pushed"), pushes=((0.1, 0.3, 10.0, 0.0, "nothing"),)),
}


def same(ours: dict, theirs: dict) -> None:
    assert set(theirs) <= set(ours)
    for name, value in theirs.items():
        if isinstance(value, dict):
            same(ours[name], value)
        else:
            assert ours[name] == pytest.approx(value, rel=1e-12, abs=1e-12, nan_ok=True), name


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("window", [(0.0, 9.0), (0.3, 0.8)])
def test_the_same_numbers(name, window):
    t = RUNS[name]()
    same(measure(t, window), referee.numbers(t, window))


def test_the_window_is_that_of_its_times():
    t = made("walk")
    assert span_of(t, (0.5, 1.0)) == slice(500, 1001)
    assert span_of(t, (0.5, 0.5)) is None
    assert span_of(t, (3.0, 4.0)) is None


@pytest.mark.parametrize("row", [1, 700])
def test_it_ends_where_a_link_is_too_fast(row):
    """What comes before counts as if the run had ended there; nothing of what comes after does."""
    t = replace(made("walk"), log=made("walk").log.copy())
    t.v[row:, 4] = 1e4
    judged, numbers = assess(t, (0.1, 2.0))
    assert (len(judged), judged.end) == (row, "diverged")
    before = measure(replace(t, log=t.log[:row].copy(), end="diverged"), (0.1, 2.0))
    np.testing.assert_equal(numbers, before)


def test_a_start_that_is_no_number_is_too_fast():
    t = replace(made("walk"), log=made("walk").log.copy())
    t.v[:, 4] = np.nan  # the start's speed is part of what there is
    assert first_too_fast(t) == 0
    assert len(assess(t, (0.1, 2.0)).trajectory) == 1


def test_a_number_that_is_none_is_too_fast():
    t = replace(made("walk"), log=made("walk").log.copy())
    t.v[500, 3] = np.nan
    assert first_too_fast(t) == 500
