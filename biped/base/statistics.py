"""Statements about ensembles."""

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


def trials_to_tell(rate: float, share: float, z: float = Z95) -> int | None:
    """How few trials tell a proportion from `share` by Wilson's interval, if `rate` of them succeed; None: no number.

    The interval of n trials reaches to `share` as long as |rate - share| <= z sqrt(share (1 - share) / n).

    Args:
        rate: Of the trials, 0 … 1.
        share: Strictly between 0 and 1.
        z: Normal quantile.
    """
    apart = rate - share
    return None if apart == 0.0 else math.ceil(z * z * share * (1.0 - share) / (apart * apart) * (1.0 - 1e-12))


def trials_as_narrow(rate: float, low: float, high: float, z: float = Z95) -> float:
    """Trials whose count would give a rate, a rare one above all, an interval as narrow on a logarithmic scale."""
    half = 0.5 * math.log(high / max(low, 1e-300))
    return z * z * (1.0 - rate) / rate / max(half, 1e-9) ** 2


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


POWER = 0.8
"""Probability with which a drop that is called visible would be seen."""
UNLIKELY = 0.05
"""Two-sided p-value below which two counts are taken to be of different rates."""
_EXACT = 2_000
"""Most trials whose counts are compared exactly; beyond, the normal approximation is as good."""


def detectable_drop(successes: int, trials: int) -> int | None:
    """Most successes of as many new trials that show, by Fisher's exact test at 5 %, that the rate has dropped.

    Args:
        successes: Of these trials.
        trials: Number of trials, now and then.

    Returns:
        None where no count would show it.
    """

    def shows(count: int) -> bool:
        if trials <= _EXACT:
            return same_rate(successes, count, trials, trials) < UNLIKELY
        pooled = (successes + count) / (2 * trials)
        scatter = math.sqrt(2.0 * pooled * (1.0 - pooled) / trials)
        return successes > count and (successes - count) / trials > Z95 * scatter

    if successes == 0 or not shows(0):
        return None
    low, high = 0, successes  # shows(low), not shows(high): Fisher's p grows with the count below `successes`
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if shows(middle) else (low, middle)
    return low


def smallest_drop(successes: int, trials: int) -> float | None:
    """The rate to which a drop shows: as many new trials at that rate are seen to be worse in four cases of five.

    Args:
        successes: Of these trials.
        trials: Number of trials.

    Returns:
        The highest such rate, 0 … 1; None where not even a rate of zero would show.
    """
    most = detectable_drop(successes, trials)
    if most is None:
        return None
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _at_most(most, trials, middle) >= POWER else (low, middle)
    return low


def _at_most(count: int, trials: int, rate: float) -> float:
    """Probability that at most `count` of `trials` succeed."""
    if rate <= 0.0:
        return 1.0
    if trials > _EXACT:
        return 0.5 * math.erfc((trials * rate - count - 0.5) / math.sqrt(2.0 * trials * rate * (1.0 - rate) + 1e-300))
    log = [math.lgamma(n + 1) for n in range(trials + 1)]
    odds, misses = math.log(rate), math.log1p(-rate) if rate < 1.0 else -math.inf
    return sum(
        math.exp(log[trials] - log[k] - log[trials - k] + k * odds + (trials - k) * misses) for k in range(count + 1)
    )
