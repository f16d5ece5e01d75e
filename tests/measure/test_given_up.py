"""The sentinel of ticks that a law gives up: its torques there are no solution of the problem that it has to solve."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from biped.ensemble.campaign import run_one
from biped.measure.metrics.walking import kind_of
from biped.measure.verdict import GIVEN_UP
from biped.robot.run import factory_of
from biped.studies.run import plan_of

SECOND = ["duration=1.0", "window={start=0.1, end=1.0}", "expect={}"]


def judged(name: str, *changes: str) -> tuple[Any, Any]:
    return run_one(plan_of(name, [*SECOND, *changes]), 0)


PARALLEL = ["actuation.pushing.friction=1e5", "actuation.pushing.regularisation=1e-14"]
"""Friction with which the edges of a cone are parallel but for rounding, and torques that cost nothing."""


@pytest.mark.parametrize("name", ["spatial/quick", "calm/own"])
def test_a_run_with_given_up_ticks_is_doubtful_and_says_how_many(name):
    t, row = judged(name, *PARALLEL)
    count = t.warnings[GIVEN_UP]
    assert 0 < count < len(t)
    assert (row.verdict, row.warnings) == ("doubtful", {GIVEN_UP: count})
    said = f"its law gave up at {t.time[-1]:.3f} s: in {count} of {len(t)} ticks its torques are no solution, at most 0"
    assert said in row.doubt
    assert "its law gave up" in kind_of(row.as_dict())
    assert not row.walked


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("spatial/quick", ()),
        ("calm/own", ()),
        ("level_normal", ("actuation.limit=bounded", "actuation.torque_limit=60.0")),
        ("upright/late", ()),
    ],
)
def test_an_ordinary_run_has_none(name, changes):
    t, row = judged(name, *changes)
    assert GIVEN_UP not in t.warnings
    assert "gave up" not in row.doubt


class GivesUp:
    """A law of the user's own that gives up in every tenth tick."""

    def __init__(self, setup):
        self.signals, self._size, self._ticks = {"given_up": 0.0}, len(setup.torque_limit), 0

    def torques(self, sensed) -> np.ndarray:
        """Nothing."""
        self.signals["given_up"] = float(self._ticks % 10 == 0)
        self._ticks += 1
        return np.zeros(self._size)


@pytest.mark.parametrize("name", ["any/h1", "level_normal"])
def test_a_law_of_ones_own_says_it_by_its_signal(name):
    t, row = run_one(plan_of(name, [*SECOND, "push=[]", "randomise={}"], factory_of(GivesUp)), 0)
    assert t.warnings[GIVEN_UP] == pytest.approx(0.1 * len(t), abs=1.0)
    assert "its law gave up" in row.doubt
