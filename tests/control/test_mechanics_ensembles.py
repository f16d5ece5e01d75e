"""Ensembles of pushed walks by `control.mechanics`: whoever computes the law's matrices, as many walk, and as fast.

The runs have the same starts and pushes. They come apart as rounding grows, so that counts and means are compared, to
three standard errors of as many independent runs. `pytest -m slow -s` prints them.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
import pytest

from biped.ensemble.campaign import run_one
from biped.studies.run import plan_of

RUNS = 20
CHANGES = ("start.jitter=0.04", f"randomise.runs={RUNS}", "expect={}")
"""More than the gait bears in every run: counts of walks that all succeed would hardly differ."""
ERRORS = 3.0


class Walks(NamedTuple):
    """Outcomes of an ensemble."""

    walked: np.ndarray
    speed: np.ndarray

    @property
    def mean(self) -> float:
        """[m/s] of the runs that walked."""
        return float(self.speed[self.walked].mean())

    @property
    def error(self) -> float:
        """[m/s] standard error of the mean."""
        return float(self.speed[self.walked].std(ddof=1) / np.sqrt(self.walked.sum()))


def walks(mechanics: str) -> Walks:
    plan = plan_of("any/h1_push", [*CHANGES, f"control.mechanics={mechanics}"])
    rows = [run_one(plan, index)[1] for index in range(RUNS)]
    return Walks(np.array([row.walked for row in rows]), np.array([row.speed for row in rows]))


@pytest.mark.slow
def test_as_many_walk_as_fast_whoever_computes():
    found = {mechanics: walks(mechanics) for mechanics in ("compiled", "pinocchio", "engine")}
    for mechanics, one in found.items():
        print(f"{mechanics}: {one.walked.sum()} of {RUNS}, {one.mean:.3f} ± {one.error:.3f} m/s")
        assert 0.2 * RUNS < one.walked.sum() < RUNS, "the comparison would see little"
    for one, other in combinations(found.values(), 2):
        share = 0.5 * (one.walked.mean() + other.walked.mean())
        apart = abs(one.walked.mean() - other.walked.mean())
        assert apart <= ERRORS * np.sqrt(2.0 * share * (1.0 - share) / RUNS)
        assert abs(one.mean - other.mean) <= ERRORS * np.hypot(one.error, other.error)
