"""The table of leg states (Fig 3.3)."""

from __future__ import annotations

import numpy as np
import pytest

from biped.control.planar.tick import leg_states
from tests.ticks import Bench

STRAIGHT, BENT = -0.04, -0.06
AHEAD, BEHIND = 0.2, -0.2


@pytest.fixture(scope="module")
def record():
    return Bench().c


def state(c, leg: int, toe: int, heel: int, knee: float, lead: float, thigh: float = 0.0) -> int:
    """State 1 … 4 of a leg whose thigh is at `thigh` from upright and leads the other by `lead` [rad]."""
    q = np.zeros(9)
    q[4 + 3 * leg] = knee
    c["memory"]["believed"][:] = 0
    c["memory"]["believed"][2 * leg : 2 * leg + 2] = toe, heel
    c["at"]["angle"][:] = 0.0
    c["at"]["angle"][1 + 3 * leg] = thigh
    c["at"]["angle"][4 - 3 * leg] = thigh - lead
    leg_states(c, q)
    return int(c["memory"]["phase"][leg]) + 1


@pytest.mark.parametrize("leg", [0, 1])
@pytest.mark.parametrize(
    ("toe", "heel", "knee", "lead", "expected"),
    [
        (0, 1, BENT, BEHIND, 1),
        (1, 1, STRAIGHT, AHEAD, 1),
        (0, 1, STRAIGHT, AHEAD, 1),
        (1, 0, BENT, BEHIND, 2),
        (1, 0, STRAIGHT, AHEAD, 2),
        (0, 0, BENT, AHEAD, 3),
        (0, 0, BENT, BEHIND, 3),
        (0, 0, STRAIGHT, BEHIND, 3),
        (0, 0, STRAIGHT, 0.09, 3),
        (0, 0, STRAIGHT, 0.11, 4),
        (0, 0, STRAIGHT, AHEAD, 4),
    ],
)
def test_states(record, leg, toe, heel, knee, lead, expected):
    assert state(record, leg, toe, heel, knee, lead) == expected


@pytest.mark.parametrize("leg", [0, 1])
def test_a_leg_that_landed_on_its_toe_is_in_stance(record, leg):
    """Beyond 100° the thigh still points far forward: toe contact is a landing, not a push-off."""
    assert state(record, leg, 1, 0, BENT, 0.0, np.radians(9.9)) == 2
    assert state(record, leg, 1, 0, BENT, 0.0, np.radians(10.1)) == 1
    assert state(record, leg, 0, 0, BENT, 0.0, np.radians(30.0)) == 3


@pytest.mark.parametrize("leg", [0, 1])
def test_a_toe_that_drags_past_the_other_leg_swings(record, leg):
    """Only where a scenario says so, and never a leg that has just landed or stands on its heel."""
    try:
        record["sensing"]["passing"] = 0.07
        assert state(record, leg, 1, 0, BENT, 0.06) == 2
        assert state(record, leg, 1, 0, BENT, 0.08) == 3
        assert state(record, leg, 1, 0, BENT, 0.08, np.radians(10.1)) == 1
        assert state(record, leg, 1, 1, BENT, 0.08) == 1
        record["sensing"]["passing"] = -0.07
        assert state(record, leg, 1, 0, BENT, -0.08) == 2
        assert state(record, leg, 1, 0, BENT, -0.06) == 3, "it has not passed yet, but is nearly beside the other"
    finally:
        record["sensing"]["passing"] = np.inf
    assert state(record, leg, 1, 0, BENT, 3.0) == 2


def test_late_stance_is_measured_like_the_springs(record):
    """On a slope with angles from gravity the limit tilts with them."""
    record["belief"]["tilt"] = np.radians(5.0)
    try:
        assert state(record, 0, 1, 0, BENT, 0.0, np.radians(5.1)) == 1
        assert state(record, 0, 1, 0, BENT, 0.0, np.radians(4.9)) == 2
    finally:
        record["belief"]["tilt"] = 0.0
