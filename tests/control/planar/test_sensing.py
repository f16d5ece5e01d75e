"""Contacts are believed after their hold time, tick by tick."""

from __future__ import annotations

import numpy as np
import pytest

from biped.control.planar.sensing import believe_contacts, first_belief
from biped.scenario.keys import Scenario, Sensing
from tests.ticks import Bench, dynamics

LOW, HIGH = 0.0, 0.01
HOLDS = {"toe": (5, 2), "heel": (6, 4)}  # ticks: on, off


@pytest.fixture(scope="module")
def record():
    return Bench(Scenario(sensing=Sensing(heel_on=0.006, heel_off=0.004, toe_on=0.005, toe_off=0.002))).c


def told(c, point: int, heights) -> list[int]:
    """What is believed of a point after each tick of heights."""
    out = []
    for height in heights:
        c["tick"]["height"][:] = HIGH
        c["tick"]["height"][point] = height
        believe_contacts(c)
        out.append(int(c["memory"]["believed"][point]))
    return out


@pytest.mark.parametrize("point", range(4))
def test_a_change_counts_after_its_hold_time(record, point):
    on, off = HOLDS["heel" if point % 2 else "toe"]
    record["tick"]["height"][:] = HIGH
    first_belief(record)
    assert told(record, point, [LOW] * (on - 1)) == [0] * (on - 1)
    assert told(record, point, [LOW]) == [1]
    assert told(record, point, [HIGH] * (off - 1)) == [1] * (off - 1)
    assert told(record, point, [HIGH]) == [0]


@pytest.mark.parametrize("point", range(4))
def test_an_interrupted_change_starts_again(record, point):
    on, _ = HOLDS["heel" if point % 2 else "toe"]
    record["tick"]["height"][:] = HIGH
    first_belief(record)
    assert not any(told(record, point, [*[LOW] * (on - 1), HIGH, *[LOW] * (on - 1)]))
    assert told(record, point, [LOW]) == [1]


def test_without_a_hold_a_change_counts_at_once():
    c = Bench(Scenario(sensing=Sensing(heel_on=0.0, heel_off=0.0, toe_on=0.0, toe_off=0.0))).c
    c["tick"]["height"][:] = HIGH
    first_belief(c)
    for point in range(4):
        assert told(c, point, [LOW, HIGH, LOW, LOW, HIGH]) == [1, 0, 1, 1, 0]


def test_the_threshold_is_the_contact_height(record):
    record["tick"]["height"][:] = [0.00099, 0.00101, -0.001, 0.0]
    first_belief(record)
    assert record["memory"]["believed"].tolist() == [1, 0, 1, 1]


def test_links_and_points_are_where_mujoco_has_them():
    bench = Bench()
    rng = np.random.default_rng(0)
    for _ in range(20):
        q, v = rng.normal(0.0, 0.5, 9), rng.normal(size=9)
        bench.tick(q, v)
        np.testing.assert_allclose(bench.c["tick"]["height"], dynamics(q, v).height, atol=1e-13)
        np.testing.assert_allclose(
            bench.c["at"]["angle"][[0, 1, 3, 6]], [q[2], q[2:4].sum(), q[2:6].sum(), q[[2, 6, 7, 8]].sum()]
        )
