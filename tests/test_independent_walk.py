"""The walk with joint torques against a second program that shares no code with the package."""

from __future__ import annotations

import numpy as np
import pytest

from biped.api import run
from biped.base.files import locate
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.scenario.reading import read
from tests.independent_walk import PLASTIC, STARTS, Reading, means, walk

HUMAN = locate("models", "human", "")
TICKS = 300
READINGS = {"bounded": Reading(), "plastic": PLASTIC}


@pytest.mark.parametrize(
    ("gait", "posture", "reading"),
    [("slow", "single", "bounded"), ("normal", "heel_toe", "bounded"), ("fast", "flat", "bounded"),
     ("slow", "flat", "plastic")],
)  # fmt: skip
def test_every_tick_of_a_start_is_the_same(gait, posture, reading):
    changes = [
        f"reading={reading}",
        "start.settle=false",
        f"start.posture={posture}",
        "duration=0.3",
        "window={start=0.0,end=0.3}",
    ]
    mine = simulate(Plan(*read(f"level_{gait}", changes)).run(0))
    numbers = READINGS[reading]
    other = walk(HUMAN, gait, np.array(STARTS[posture]), 1e-3 * TICKS, numbers)
    assert mine.q.shape == other.q.shape == (TICKS, 9)
    assert np.abs(mine.q - other.q).max() < 1e-6
    assert np.abs(mine.v - other.v).max() < 1e-6
    assert np.abs(mine.u - other.u).max() < 1e-6 * numbers.limit
    assert np.abs(other.u).max() == pytest.approx(numbers.limit, rel=1e-12), "limits within (3.13) were never asked for"


@pytest.mark.slow
def test_the_means_of_an_ensemble_are_the_same():
    """Walks part within seconds, so that only means can be compared: six starts of each, 95 % intervals."""
    made = run("level_normal", seed=31, start={"settle": False, "jitter": 0.002}, randomise={"runs": 6}, jobs=1)
    mine = [row for row in made.runs.to_pylist() if row["walked"]]
    random, others = np.random.default_rng(31), []
    for _ in range(6):
        start = np.array(STARTS["heel_toe"])
        start[2:] += 0.002 * random.standard_normal(7)
        one = walk(HUMAN, "normal", start, 10.0, PLASTIC)
        if not one.fell:
            others.append(means(one))
    assert min(len(mine), len(others)) >= 5
    for name in ("speed", "cost_of_transport"):
        a, b = (np.array([row[name] for row in rows]) for rows in (mine, others))
        half = 2.2 * np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))
        assert abs(a.mean() - b.mean()) < half, (name, a.mean(), b.mean(), half)
