"""Statements about ensembles."""

from __future__ import annotations

import math

Z95 = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""


def wilson(successes: int, trials: int, z: float = Z95) -> tuple[float, float]:
    """Wilson's score interval of a proportion (E. B. Wilson, JASA 22, 1927).

    Args:
        successes: Number of successes.
        trials: Number of trials; none gives (0, 1).
        z: Normal quantile.

    Returns:
        Lower and upper bound, 0 … 1.
    """
    if trials == 0:
        return 0.0, 1.0
    p = successes / trials
    scale = 1.0 + z * z / trials
    centre = p + z * z / (2 * trials)
    half = z * math.sqrt(p * (1.0 - p) / trials + z * z / (4 * trials * trials))
    # At 0 and n successes the bound is exactly 0 or 1; rounding must not say otherwise.
    low = 0.0 if successes == 0 else (centre - half) / scale
    high = 1.0 if successes == trials else (centre + half) / scale
    return low, high


def enough_for(rate: float, z: float = Z95) -> int | None:
    """How few trials, all successes, show by Wilson's interval that a proportion is at least `rate`; None: no number.

    With n of n successes the lower bound is n / (n + z²).
    """
    return None if rate >= 1.0 else math.ceil(z * z * rate / (1.0 - rate))


def same_rate(first: int, second: int, trials: int, other: int) -> float:
    """Probability of counts at least as unlikely as these if both ensembles had one rate: Fisher's exact test.

    Args:
        first: Successes of the first ensemble.
        second: Successes of the second.
        trials: Runs of the first ensemble.
        other: Runs of the second.

    Returns:
        The two-sided p-value, 0 … 1 (R. A. Fisher, J. R. Stat. Soc. 85, 1922).
    """
    total = first + second
    ways = [math.comb(trials, k) * math.comb(other, total - k) for k in range(total + 1)]
    return sum(way for way in ways if way <= ways[first]) / sum(ways)
