"""Statements about pairs: the same runs under two conditions, and whether what changed is more than chance."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from biped.base.statistics import wilson


class Estimate(NamedTuple):
    """A change with what is known of it.

    Attributes:
        change: Second less first.
        low: Lower bound of its 95 % interval; nan if there is none.
        high: Upper bound.
        p: Two-sided probability of a change at least as large by chance alone; nan if there is none.
    """

    change: float
    low: float
    high: float
    p: float


UNKNOWN = Estimate(math.nan, math.nan, math.nan, math.nan)
"""Of no pairs."""


def shares(both: int, first: int, second: int, neither: int) -> Estimate:
    """The change of a proportion from paired yes and no.

    Only pairs that disagree say whether it changed: by chance they go either way alike, which is McNemar's test in its
    exact form (Q. McNemar, Psychometrika 12, 1947). The interval is made of Wilson's two, with the correlation of the
    pairs (R. G. Newcombe, Stat. Med. 17:2635, 1998, method 10): it has a width where nothing at all changed, too.

    Args:
        both: Pairs that succeeded under both conditions.
        first: Pairs that succeeded under the first alone.
        second: Pairs that succeeded under the second alone.
        neither: Pairs that succeeded under neither.
    """
    n = both + first + second + neither
    if n == 0:
        return UNKNOWN
    discordant = first + second
    tail = sum(math.comb(discordant, k) for k in range(min(first, second) + 1))
    p = min(1.0, 2.0 * tail / 2**discordant)
    before, after = (both + first) / n, (both + second) / n
    (l1, u1), (l2, u2) = wilson(both + first, n), wilson(both + second, n)
    margins = (both + first) * (second + neither) * (both + second) * (first + neither)
    excess = both * neither - first * second
    excess = max(excess - n / 2, 0.0) if excess > 0 else float(excess)
    phi = excess / math.sqrt(margins) if margins else 0.0

    def reach(one: float, other: float) -> float:
        return math.sqrt(max(one * one - 2.0 * phi * one * other + other * other, 0.0))

    change = after - before
    return Estimate(change, change - reach(after - l2, u1 - before), change + reach(u2 - after, before - l1), p)


def means(differences: Sequence[float]) -> Estimate:
    """The mean of paired differences with Student's interval and test.

    If nothing changed but chance, either member of a pair might have been the first: differences are then symmetric
    about zero whatever the numbers' distribution, and with heavy tails Student's test errs on the side of finding
    nothing (B. Efron, JASA 64:1278, 1969).

    Args:
        differences: Second less first of every pair; fewer than two say nothing.
    """
    n = len(differences)
    if n == 0:
        return UNKNOWN
    mean = math.fsum(differences) / n
    if n == 1:
        return UNKNOWN._replace(change=mean)
    error = math.sqrt(math.fsum((d - mean) ** 2 for d in differences) / (n - 1) / n)
    if error <= 1e-15 * abs(mean):  # all alike, but for rounding
        return Estimate(mean, mean, mean, 1.0 if mean == 0.0 else 0.0)
    from scipy.special import stdtr, stdtrit

    half = float(stdtrit(n - 1, 0.975)) * error
    return Estimate(mean, mean - half, mean + half, float(2.0 * stdtr(n - 1, -abs(mean) / error)))


def holm(p: Sequence[float]) -> list[float]:
    """Probabilities for the most surprising of several tests: S. Holm's (Scand. J. Stat. 6:65, 1979).

    Rejecting those below 5 % makes even one false alarm among all tests no likelier than 5 %, however they depend on
    one another.

    Args:
        p: Of each test by itself; nan of one that could not be made, which is none.

    Returns:
        In the same order, at most 1; nan stays nan.
    """
    order = sorted((i for i in range(len(p)) if not math.isnan(p[i])), key=lambda i: p[i])
    out, least = [math.nan] * len(p), 0.0
    for rank, i in enumerate(order):
        least = max(least, min(1.0, (len(order) - rank) * p[i]))
        out[i] = least
    return out
