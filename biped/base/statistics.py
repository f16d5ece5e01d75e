"""Statements about ensembles, about pairs of the same runs under two conditions, and about pairs as they come.

Of two walks, which more often? Pairs in which both walk or neither does say nothing about which is better. Of the
others the second alone walks with probability r / (1 + r) if it does so r times as often as the first: Wald's
sequential test of double dichotomies (A. Wald, Sequential Analysis, 1947, chapter 6), once for each way, as P. Armitage
has it (Biometrika 44:9, 1957). A third test of Wald's asks whether more than a share of all pairs disagree at all.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

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


def rank_correlation(first: Sequence[float], second: Sequence[float]) -> tuple[float, float, float]:
    """Spearman's rank correlation of pairs, and its 95 % interval.

    The interval is Fisher's with the variance of D. Bonett and T. Wright (Psychometrika 65:23, 2000), which holds for
    ranks of small samples.

    Args:
        first: Numbers, infinite ones too.
        second: As many, at least four.
    """
    import numpy as np
    from scipy.stats import rankdata

    rho = float(np.corrcoef(rankdata(first), rankdata(second))[0, 1])
    if math.isnan(rho) or abs(rho) >= 1.0:
        return rho, rho, rho
    half = Z95 * math.sqrt((1.0 + 0.5 * rho * rho) / (len(first) - 3))
    return rho, math.tanh(math.atanh(rho) - half), math.tanh(math.atanh(rho) + half)


BETTER, WORSE, SAME, UNDECIDED = "better", "worse", "same", "cannot say"


class Rates(NamedTuple):
    """The errors that a sequential test may make.

    Attributes:
        error: Probability of *better* or *worse* where neither is, and of *same* where one walks `ratio` times as often
            alone as the other and more than `share` of the pairs disagree.
        ratio: How many times as often one must walk where the other does not for the difference to count.
        share: Of all pairs that disagree, up to which two are the same.
    """

    error: float = 0.05
    ratio: float = 3.0
    share: float = 0.05


class _Wald:
    """A sequential probability ratio test of yes and no.

    Args:
        null: Probability of yes under the null hypothesis.
        other: Under the other one.
        alpha: Probability of choosing the other one wrongly.
        beta: Of choosing the null hypothesis wrongly.
    """

    def __init__(self, null: float, other: float, alpha: float, beta: float):
        self._yes, self._no = math.log(other / null), math.log((1.0 - other) / (1.0 - null))
        self._high, self._low = math.log((1.0 - beta) / alpha), math.log(beta / (1.0 - alpha))
        self._evidence = 0.0
        self.chosen: bool | None = None

    def add(self, yes: bool) -> None:
        """Takes in an observation; once one is chosen, nothing changes that."""
        if self.chosen is not None:
            return
        self._evidence += self._yes if yes else self._no
        if self._evidence >= self._high:
            self.chosen = True
        elif self._evidence <= self._low:
            self.chosen = False


class SequentialTest:
    """The test, to which pairs are added one by one.

    Args:
        rates: The errors that it may make.

    Attributes:
        decision: `better`, `worse` or `same` of the second of the pairs; `cannot say` until it is decided.
        pairs: How many it took, up to the decision.
    """

    def __init__(self, rates: Rates):
        error, odds = rates.error, rates.ratio / (1.0 + rates.ratio)
        # Either way may cry wolf; a difference may be missed by its own test, or by the one that asks for the share.
        self._up, self._down = (_Wald(0.5, odds, 0.5 * error, 0.8 * error) for _ in range(2))
        self._few = _Wald(rates.share, 0.25 * rates.share, 0.2 * error, error)
        self._rates, self.decision, self.pairs = rates, UNDECIDED, 0

    @property
    def words(self) -> str:
        """The decision in a line."""
        r = self._rates
        if self.decision == SAME:
            what = (
                f"neither walks {r.ratio:g} times as often where the other does not, or {r.share:.0%} of the pairs or "
                "fewer disagree"
            )
        else:
            what = {BETTER: "the second walks more often", WORSE: "the second walks less often"}.get(
                self.decision, "not decided: more pairs would (--most)")  # fmt: skip
        return f"sequential test: {self.decision} after {self.pairs} pairs ({what}); wrong in at most {r.error:.0%}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {"decision": self.decision, "pairs": self.pairs, **self._rates._asdict()}

    def add(self, first: bool, second: bool) -> None:
        """Takes in a pair: whether each of the two walked."""
        if self.decision != UNDECIDED:
            return
        self.pairs += 1
        self._few.add(first != second)
        if first != second:
            self._up.add(second)
            self._down.add(first)
        if self._up.chosen:
            self.decision = BETTER
        elif self._down.chosen:
            self.decision = WORSE
        elif self._few.chosen or (self._up.chosen is False and self._down.chosen is False):
            self.decision = SAME


def decided(pairs: Iterable[tuple[bool, bool]], rates: Rates) -> SequentialTest:
    """The test after some pairs."""
    test = SequentialTest(rates)
    for first, second in pairs:
        test.add(first, second)
    return test
