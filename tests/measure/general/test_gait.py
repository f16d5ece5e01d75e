"""Steps of a walk in space: across the way that is walked, however the torso turns in a stride."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from biped.engines.general.simulate import simulate
from biped.ensemble.plan import Plan
from biped.measure.general.gait import courses, foot_places, headings, sideways, strikes_of
from biped.measure.general.ground import extrapolated, margin_of_stability
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
    steps = [step for step in strikes_of(walk) if span.start <= step[0] < span.stop]
    feet = foot_places(walk)
    widths = [abs(feet[row, 0, 1] - feet[row, 1, 1]) for row, _ in steps]
    found = sideways(walk, span, [(row - span.start, foot) for row, foot in steps])
    assert found["step_width"] == pytest.approx(np.mean(widths), abs=0.02)
    assert found["cross_over"] == 0.0
    least = []
    for (a, foot), (b, _) in pairwise(steps):
        rows = np.arange(a, b)[walk.down[a:b].sum(axis=1) == 1]
        outer = walk.point[rows, 4 * foot : 4 * foot + 4, 1] * (-1.0, 1.0)[foot]
        least.append((outer.max(axis=1) - extrapolated(walk)[rows, 1] * (-1.0, 1.0)[foot]).min())
    assert margin_of_stability(walk, span) == pytest.approx(np.mean(least), abs=0.03)
