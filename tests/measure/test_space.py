"""Steps of a walk in space: across the way that is walked, however the torso turns in a stride."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.measure.metrics.gait import (
    bearing,
    extrapolated,
    foot_places,
    margin_of_stability,
    sideways,
)
from biped.measure.metrics.walking import outcome_of
from biped.measure.signals import cost_of_transport
from biped.scenario.reading import read_scenario


@pytest.fixture(scope="module")
def walk():
    t = simulate(Plan(read_scenario("spatial/own", ["duration=4.0"])).run(0))
    assert t.end == "completed"
    return t


def test_the_course_is_straight_though_the_torso_turns(walk):
    inner = slice(1500, 3000)
    assert np.ptp(np.degrees(walk.heading[inner])) > 8.0
    assert np.ptp(np.degrees(walk.course[inner])) < 3.0


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


def test_heading_is_that_of_the_last_stride_whenever_in_it_the_run_ends(walk):
    """At the moments of one stride its torso faces from 4° to the right to 4° to the left."""
    stride = 2 * round(np.median(np.diff([row for row, _ in walk.strikes])))
    ends = range(len(walk) - stride, len(walk) + 1, stride // 8)
    cut = [_until(walk, end) for end in ends]
    faced = [np.degrees(one.heading[-1]) for one in cut]
    found = [sideways(one, slice(1500, len(one)))["heading"] for one in cut]
    assert np.ptp(faced) > 8.0
    assert np.ptp(found) < 2.0


def test_veering_is_of_the_way_and_heading_of_the_torso(walk):
    """Walked along another line by a walker that faces as before."""
    span, before = slice(1500, 3900), sideways(walk, slice(1500, 3900))
    turn = np.radians(10.0)
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    log, (place, _) = walk.log.copy(), walk.columns["base"]
    at = log[:, place : place + 2]
    at[:] = at[0] + (at - at[0]) @ turned.T
    aside = sideways(replace(walk, log=log), span)
    assert aside["veering"] == pytest.approx(before["veering"] + 10.0, abs=1e-9)
    assert aside["heading"] == before["heading"]
    assert np.isnan(sideways(_until(walk, 1000), slice(500, 1000))["veering"]) == (walk.base[999, 0] < walk.robot.leg)


def _turned(t, angle):
    """The same walk in another direction."""
    c, s = np.cos(angle), np.sin(angle)
    turn, log = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), t.log.copy()
    for name in ("base", "point", "figure", "com", "com_velocity", "v"):
        first, shape = t.columns[name] if name != "v" else (t.columns["v"][0] + t.robot.base_columns[0], 3)
        size = np.prod(shape)
        places = log[:, first : first + (3 if name == "base" else size)].reshape(len(log), -1, 3)
        log[:, first : first + 3 * places.shape[1]] = (places @ turn.T).reshape(len(log), -1)
    first = t.columns["base"][0] + 3
    w, x, y, z = log[:, first : first + 4].T.copy()
    h, k = np.cos(0.5 * angle), np.sin(0.5 * angle)
    log[:, first : first + 4] = np.stack([h * w - k * z, h * x - k * y, h * y + k * x, h * z + k * w], axis=1)
    return replace(t, log=log)


@pytest.mark.parametrize("angle", [0.7, -2.5])
def test_joints_and_lean_are_seen_from_the_side_wherever_the_walk_goes(walk, angle):
    other = _turned(walk, angle)
    assert np.allclose(other.heading, walk.heading + angle)
    assert np.allclose(other.joint_angles, walk.joint_angles, atol=1e-12)
    assert np.allclose(other.lean, walk.lean, atol=1e-12)
    assert np.allclose(other.forward_speed, walk.forward_speed, atol=1e-12)
    assert np.allclose(cost_of_transport(other), cost_of_transport(walk), equal_nan=True)
    before, after = measure(walk, (2.0, 3.9)), measure(other, (2.0, 3.9))
    names = "torso_lean", "torso_sway", "stance_knee", "step_length", "speed_std", "step_width", "margin_of_stability"
    for name in names:
        assert after[name] == pytest.approx(before[name], abs=1e-9)


@pytest.mark.parametrize("number", ["heading", "veering"])
def test_straight_is_neither_turned_nor_aside(walk, number):
    numbers = measure(walk, (2.0, 3.9))
    assert (numbers["walked"], numbers["straight"]) == (1, 1)
    for angle, straight in ((-5.1, 0), (-4.9, 1), (4.9, 1), (5.1, 0)):
        found = outcome_of(walk, numbers | {number: angle}, "sound", 1.9)
        assert (found["walked"], found["straight"]) == (1, straight)


def _until(t, end):
    return replace(t, log=t.log[:end], outside=t.outside[:end])


def _margin(t, row, touching):
    """[m] along y from the extrapolated centre of mass to an edge of what bears, on one foot to its outer edge."""
    y = t.point[row, :, 1]
    at = extrapolated(t)[row, 1]
    right, left = touching[:4].any(), touching[4:].any()
    found = [y[touching].max() - at] if left else []
    found += [at - y[touching].min()] if right else []
    return min(found, default=np.inf)
