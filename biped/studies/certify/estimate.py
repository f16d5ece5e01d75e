"""A probability with its interval: from counts, and from independent unbiased estimates."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from biped.base.statistics import wilson

LEAST_SAMPLES = 5
"""Independent estimates from which an interval is made."""


class Probability(NamedTuple):
    """A probability.

    Attributes:
        value: The estimate.
        low: Lower bound of its 95 % interval.
        high: Upper bound.
    """

    value: float
    low: float
    high: float

    @property
    def relative(self) -> float:
        """Half the interval over the estimate; infinite where nothing fell."""
        return 0.5 * (self.high - self.low) / self.value if self.value > 0.0 else math.inf


def counted(falls: int, runs: int) -> Probability:
    """The probability that falls among plain runs show, with Wilson's interval."""
    return Probability(falls / runs if runs else 0.0, *wilson(falls, runs))


def combined(estimates: Sequence[float], least: float = 0.0) -> Probability:
    """The mean of independent unbiased estimates, with Student's interval of its logarithm.

    Estimates by splitting scatter by factors and not by differences, and none is below zero. The standard error of
    the logarithm of their mean is that of the mean over the mean (the delta method), or that of lognormal numbers (D.
    Cox's; G. Zhou, S. Gao, Stat. Med. 16:783, 1997), whichever is larger: the largest of many such estimates, which
    decides their mean, is often not among the few that there are. Few estimates that agree by chance scatter too
    little, and those that do are mostly low: the scatter is not taken for less than is known of it.

    Args:
        estimates: One of each sample.
        least: Relative standard deviation that an estimate has at least.
    """
    n = len(estimates)
    mean = math.fsum(estimates) / n
    if mean == 0.0 or n < 2:
        return Probability(mean, 0.0, 1.0)
    from scipy.special import stdtrit

    scatter = max(math.sqrt(math.fsum((one - mean) ** 2 for one in estimates) / (n - 1)) / mean, least)
    lowest = min(one for one in estimates if one > 0.0)
    logs = [math.log(one if one > 0.0 else 0.5 * lowest) for one in estimates]
    middle = math.fsum(logs) / n
    variance = max(math.fsum((one - middle) ** 2 for one in logs) / (n - 1), math.log1p(least * least))
    error = max(scatter / math.sqrt(n), math.sqrt(variance / n + variance * variance / (2.0 * (n - 1))))
    factor = math.exp(min(float(stdtrit(n - 1, 0.975)) * error, 700.0))
    return Probability(mean, mean / factor, min(1.0, mean * factor))


def plain_is_cheaper(falls: int, runs: int, share: float) -> bool:
    """Whether counting plain runs is cheaper than splitting, judged by a first few.

    For the same scatter, counting takes (1 − p)/p runs where splitting through m = ln p / ln q levels of a share q
    takes about 2 m² (1 − q)/q: m levels of m scatters, and twice for runs that resemble the ones they were moved from.
    """
    p = (falls + 0.5) / (runs + 1.0)
    levels = math.log(p) / math.log(share)
    return (1.0 - p) / p <= 2.0 * levels**2 * (1.0 - share) / share
