"""Wilson's interval against published values; rank correlation beside that of scipy, and what its interval covers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import spearmanr

from biped.base.statistics import Z95, enough_for, rank_correlation, trials_as_narrow, wilson


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        # R. G. Newcombe, Statistics in Medicine 17 (1998) 857-872, Table I, method 3 (score)
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_published_intervals(successes, trials, low, high):
    assert wilson(successes, trials) == pytest.approx((low, high), abs=6e-5)


def test_the_thesis_92_of_100():
    assert wilson(92, 100) == pytest.approx((0.850, 0.959), abs=5e-4)


def test_ends_are_exact():
    assert wilson(0, 50)[0] == 0.0
    assert wilson(50, 50)[1] == 1.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_failures_mirror_successes():
    low, high = wilson(7, 31)
    assert wilson(24, 31) == pytest.approx((1.0 - high, 1.0 - low))


def test_how_many_successes_show_a_rate():
    for rate in (0.5, 0.9, 0.95, 0.99):
        n = enough_for(rate)
        assert wilson(n, n)[0] >= rate > wilson(n - 1, n - 1)[0]
    assert enough_for(1.0) is None


def test_trials_of_a_rare_event_as_narrow_as_an_interval_that_counting_them_gave():
    rate, trials = 1e-4, 2_500_000
    factor = math.exp(Z95 * math.sqrt((1.0 - rate) / (rate * trials)))
    assert trials_as_narrow(rate, rate / factor, rate * factor) == pytest.approx(trials)


def test_rank_correlation_is_scipys_and_its_interval_covers():
    rng = np.random.default_rng(5)
    a, b = rng.normal(size=14), rng.normal(size=14)
    assert rank_correlation(list(a), list(b))[0] == pytest.approx(spearmanr(a, b)[0])
    assert rank_correlation(list(a), list(np.exp(a))) == pytest.approx((1.0, 1.0, 1.0))
    assert rank_correlation([math.inf, 1.0, 2.0, 3.0, 0.0], [5.0, 2.0, 3.0, 4.0, 1.0])[0] == pytest.approx(1.0)
    true = 6.0 / math.pi * math.asin(0.3)  # of normal numbers with correlation 0.6
    pairs = rng.multivariate_normal([0.0, 0.0], [[1.0, 0.6], [0.6, 1.0]], size=(400, 14))
    held = sum(low <= true <= high for _, low, high in (rank_correlation(*one.T) for one in pairs))
    assert 0.92 <= held / 400 <= 0.99
