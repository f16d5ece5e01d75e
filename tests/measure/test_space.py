"""Steps of a walk in space: across the way that is walked, however the torso turns in a stride."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.metrics.gait import (
    bearing,
    courses,
    extrapolated,
    foot_places,
    headings,
    margin_of_stability,
    sideways,
)
from biped.scenario.reading import read_scenario


@pytest.fixture(scope="module")
def walk():
    t = simulate(Plan(read_scenario("spatial/own", ["duration=4.0"])).run(0))
    assert t.end == "completed"
    return t


def test_the_course_is_straight_though_the_torso_turns(walk):
    inner = slice(1500, 3000)
    assert np.ptp(np.degrees(headings(walk)[inner])) > 8.0
    assert np.ptp(np.degrees(courses(walk)[inner])) < 3.0


def test_width_and_margin_are_across_the_way(walk):
    """It walks along x within 3 degrees: y says both."""
    span = slice(1500, 3900)
    steps = walk.strikes_in(span)
    feet = foot_places(walk)
    widths = [abs(feet[row, 0, 1] - feet[row, 1, 1]) for row, _ in steps]
    found = sideways(walk, span)
    assert found["step_width"] == pytest.approx(np.mean(widths), abs=0.02)
    assert found["cross_over"] == 0.0
    touching = bearing(walk)
    margin = [_margin(walk, row, touching[row]) for row in range(span.start, span.stop)]
    cuts = [0, *(row - span.start for row, _ in steps if row > span.start), len(margin)]
    assert margin_of_stability(walk, span) == pytest.approx(
        np.mean([min(margin[a:b]) for a, b in pairwise(cuts)]), abs=0.01
    )


def _margin(t, row, touching):
    """[m] along y from the extrapolated centre of mass to an edge of what bears, on one foot to its outer edge."""
    y = t.point[row, :, 1]
    at = extrapolated(t)[row, 1]
    right, left = touching[:4].any(), touching[4:].any()
    found = [y[touching].max() - at] if left else []
    found += [at - y[touching].min()] if right else []
    return min(found, default=np.inf)
