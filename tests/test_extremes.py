"""Extreme walks: each ends in an answer whose sentinels hold, or says doubtful, diverged or bad input.

What is recomputed here shares nothing with the sentinels but the kinematics: the work of the actuators is what they
applied times how far the coordinates went, energy is never made by contacts, and the centre of mass falls no faster
than gravity and ground allow it from one position to the next.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from biped.base.errors import InputError
from biped.ensemble.campaign import run_one
from biped.measure.trajectory import Trajectory
from biped.robot.planar.tree import motion
from biped.studies.run import plan_of
from tests.energy import energy
from tests.extremes import extreme

MADE = 0.1
"""Energy that contacts may give back, of all that was put in: they are springs with dampers."""


def outcome_of(number: int) -> str:
    name, changes = extreme(number)
    try:
        t, made = run_one(plan_of(name, changes), 0)
    except InputError:
        return "bad input"
    row = made.as_dict()
    assert row["end"] == t.end
    assert np.isfinite(t.log).all(), (number, "rows that blew up are not kept")
    if row["verdict"] != "sound":
        assert not row["walked"]
        assert not row["stood"]
        assert row["fell"] == (t.end == "fell" or row["verdict"] == "diverged"), number
        why = row["doubt"] or t.cause
        assert " at " in why or " after " in why, (number, "the time")
        return row["verdict"]
    assert t.end in ("completed", "fell"), number
    assert t.warnings.keys() <= {"chattering_steps"}, number
    assert made_of_nothing(t) < MADE, (number, name, changes)
    if row["walked"]:
        assert row["steps"] >= 2
        assert 0.8 <= row["support"] <= 1.2
    return "walked" if row["walked"] else t.end


def made_of_nothing(t: Trajectory) -> float:
    """Largest energy beyond the start's that no actuator and no push put in, as a share of all there was."""
    if len(t) < 2:
        return 0.0
    whole = motion(t.tree, t.q, t.v)
    put_in = (t.applied[:-1] * np.diff(t.q, axis=0)).sum(axis=1)
    angle = np.radians(t.slope)
    for start, end, forward, up, body in t.pushes:
        force = [forward * np.cos(angle) + up * np.sin(angle), up * np.cos(angle) - forward * np.sin(angle)]
        first, last = round(start / t.tick), round(end / t.tick)
        put_in[first:last] += (np.diff(whole.com[:, t.robot.bodies.index(body)], axis=0) @ force)[first:last]
    all_of_it = energy(t.tree, t.q, t.v, t.slope)
    made = all_of_it[1:] - all_of_it[0] - np.cumsum(put_in)
    moving = 0.5 * ((whole.com_velocity**2).sum(axis=-1) @ t.tree.mass)
    return float(made.max() / max(np.abs(put_in).sum(), moving.max(), 0.1 * abs(all_of_it[0])))


def test_forty_extreme_walks():
    """A sample of the two thousand in which every outcome occurs."""
    found = Counter(outcome_of(number) for number in range(40))
    assert found.total() == 40
    assert {"doubtful", "diverged", "fell", "completed"} <= found.keys(), found
    assert found["bad input"] < 10, found


@pytest.mark.slow
def test_two_thousand_extreme_walks():
    found = Counter(outcome_of(number) for number in range(2000))
    assert found.total() == 2000
    assert found["walked"] >= 20, found
