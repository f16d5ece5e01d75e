"""Whether one of two walks more often, asked pair by pair and answered as soon as it is decided.

Pairs in which both walk or neither does say nothing about which is better. Of the others the second alone walks with
probability r / (1 + r) if it does so r times as often as the first: Wald's sequential test of double dichotomies (A.
Wald, Sequential Analysis, 1947, chapter 6), once for each way, as P. Armitage has it (Biometrika 44:9, 1957). A third
test of Wald's asks whether more than a share of all pairs disagree at all.
"""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

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
