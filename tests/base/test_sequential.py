"""The sequential test of pairs: its error rates and how many pairs it saves, by simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom

from biped.base.statistics import BETTER, SAME, UNDECIDED, WORSE, Rates, SequentialTest, decided

REPEATS = 2000
"""Of every simulation."""
DISAGREE = 0.3
"""Share of the pairs that disagree."""


def outcomes(ratio: float, disagree: float = DISAGREE, seed: int = 1, most: int = 4000) -> list[SequentialTest]:
    """Tests of pairs of which the second alone walks `ratio` times as often as the first alone."""
    rng, rates, out = np.random.default_rng(seed), Rates(), []
    for _ in range(REPEATS):
        test = SequentialTest(rates)
        while test.decision == UNDECIDED and test.pairs < most:
            for kind, which in rng.random((32, 2)):
                if kind >= disagree:
                    test.add(True, True)
                else:
                    second = which < ratio / (1.0 + ratio)
                    test.add(not second, second)
        out.append(test)
    return out


def share(tests: list[SequentialTest], *decisions: str) -> float:
    return sum(test.decision in decisions for test in tests) / len(tests)


def fixed_size(ratio: float, error: float) -> float:
    """Pairs that disagree which McNemar's exact test at 5 % needs to miss a ratio in no more than `error` of cases."""
    for n in range(6, 400):
        critical = max((k for k in range(n // 2) if 2.0 * binom.cdf(k, n, 0.5) <= 0.05), default=-1)
        if binom.cdf(critical, n, 1.0 / (1.0 + ratio)) >= 1.0 - error:
            return n
    raise AssertionError


def test_both_errors_are_at_most_five_in_a_hundred_and_runs_are_saved():
    same, better, worse = outcomes(1.0), outcomes(3.0, seed=2), outcomes(1.0 / 3.0, seed=3)
    beyond = 3.0 * math.sqrt(0.05 * 0.95 / REPEATS)  # three standard errors of the simulation
    assert share(same, BETTER, WORSE) <= 0.05
    assert share(better, SAME, WORSE) <= 0.05
    assert share(worse, SAME, BETTER) <= 0.05
    assert share(same, BETTER) == pytest.approx(share(same, WORSE), abs=2.0 * beyond)
    fixed = fixed_size(3.0, 0.05) / DISAGREE
    for tests in (same, better, worse):
        assert np.mean([test.pairs for test in tests]) <= 0.7 * fixed


def test_two_that_hardly_ever_disagree_are_the_same():
    assert share(outcomes(1.0, disagree=0.0), SAME) == 1.0
    tests = outcomes(3.0, disagree=0.05, seed=4)
    assert share(tests, SAME, WORSE) <= 0.05


def test_pairs_that_agree_decide_nothing_about_which_is_better():
    one_way = [(False, True)] * 30
    test = decided(one_way, Rates(share=1e-6))
    assert test.decision == BETTER
    assert decided([pair for both in one_way for pair in ((True, True), both)], Rates(share=1e-6)).decision == BETTER
    assert decided([(second, first) for first, second in one_way], Rates()).decision == WORSE
    assert decided(one_way[: test.pairs - 1], Rates()).decision == UNDECIDED
