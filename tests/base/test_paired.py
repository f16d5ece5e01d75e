"""Statements about pairs, against SciPy's and against what chance alone does."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from scipy import stats

from biped.base.statistics import UNKNOWN, holm, means, shares


@pytest.mark.parametrize(("first", "second"), [(0, 5), (0, 6), (1, 9), (3, 4), (7, 7), (12, 2)])
def test_counts_are_tested_as_a_fair_coin(first, second):
    expected = stats.binomtest(first, first + second).pvalue
    assert shares(20, first, second, 3).p == pytest.approx(expected)
    assert shares(0, first, second, 0).p == pytest.approx(expected)  # pairs that agree say nothing


def test_no_pairs_say_nothing():
    np.testing.assert_equal(shares(0, 0, 0, 0), UNKNOWN)
    np.testing.assert_equal(means([]), UNKNOWN)
    one = means([0.3])
    assert one.change == 0.3
    assert math.isnan(one.p)
    assert math.isnan(one.low)


def test_an_interval_of_counts_has_a_width_where_nothing_changed():
    e = shares(100, 0, 0, 0)
    assert (e.change, e.p) == (0.0, 1.0)
    assert -0.04 < e.low < -0.03
    assert e.high == pytest.approx(-e.low)


def test_intervals_of_counts_mirror():
    for table in product(range(0, 8, 3), repeat=4):
        if not any(table):
            continue
        both, first, second, neither = table
        one, other = shares(*table), shares(both, second, first, neither)
        assert one.change == pytest.approx(-other.change)
        assert (one.low, one.high) == pytest.approx((-other.high, -other.low))
        assert -1.0 <= one.low <= one.change + 1e-12
        assert one.change - 1e-12 <= one.high <= 1.0


def _chance(counts: tuple[int, ...], p: tuple[float, ...]) -> float:
    ways = math.factorial(sum(counts)) / math.prod(math.factorial(k) for k in counts)
    return ways * math.prod(q**k for q, k in zip(p, counts, strict=True))


@pytest.mark.parametrize(
    "p", [(0.8, 0.1, 0.05, 0.05), (0.5, 0.2, 0.1, 0.2), (0.9, 0.08, 0.01, 0.01), (0.3, 0.3, 0.3, 0.1)]
)
def test_an_interval_of_counts_holds_the_change_as_often_as_it_says(p):
    n, inside = 24, 0.0
    for both in range(n + 1):
        for first in range(n + 1 - both):
            for second in range(n + 1 - both - first):
                table = (both, first, second, n - both - first - second)
                e = shares(*table)
                inside += _chance(table, p) * (e.low - 1e-12 <= p[2] - p[1] <= e.high + 1e-12)
    assert 0.93 < inside < 0.998


@pytest.mark.parametrize("n", [2, 5, 30])
def test_means_are_students(n):
    rng = np.random.default_rng(n)
    a, b = rng.standard_normal((2, n))
    theirs = stats.ttest_rel(b, a)
    mine = means(list(b - a))
    assert mine.p == pytest.approx(theirs.pvalue)
    interval = theirs.confidence_interval(0.95)
    assert (mine.low, mine.high) == pytest.approx((interval.low, interval.high))


def test_differences_that_are_all_alike_need_no_chance():
    assert means([0.0] * 7) == (0.0, 0.0, 0.0, 1.0)
    assert means([0.1] * 7).p == 0.0


@pytest.mark.parametrize("draw", ["standard_normal", "standard_cauchy", "one_in_twenty"])
def test_chance_is_not_called_a_change(draw):
    """Both members of a pair from one distribution, heavy tails included: at most one alarm in twenty."""
    rng, n, repeats = np.random.default_rng(3), 20, 2000
    if draw == "one_in_twenty":
        values = rng.standard_normal((2, repeats, n)) * 1e-3 + (rng.random((2, repeats, n)) < 0.05)
    else:
        values = getattr(rng, draw)((2, repeats, n))
    alarms = sum(means(list(d)).p < 0.05 for d in values[1] - values[0])
    assert alarms / repeats < 0.05 + 3.0 * math.sqrt(0.05 * 0.95 / repeats)


def test_holm_is_holms():
    p = [0.01, 0.04, 0.03, 0.005]
    assert holm(p) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([]) == []
    with_none = holm([math.nan, 0.01, math.nan, 0.02])
    np.testing.assert_allclose(with_none, [math.nan, 0.02, math.nan, 0.02])


def test_holm_keeps_false_alarms_of_many_tests_together_below_the_level():
    rng, repeats = np.random.default_rng(5), 2000
    alarms = sum(min(holm(list(rng.random(25)))) < 0.05 for _ in range(repeats))
    assert 0.02 < alarms / repeats < 0.065
