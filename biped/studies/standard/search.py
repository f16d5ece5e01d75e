"""The largest value that holds, and how sure that is: a ladder from the easiest outwards, then bisection."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from biped.base.statistics import wilson
from biped.scenario.standard import Standard

BEYOND = 3
"""Steps beyond the first value that fails, at most, in search of one that is sure to fail."""


class Tried(NamedTuple):
    """An ensemble at one value.

    Attributes:
        value: In multiples of what the test says.
        reached: Runs that did what they should.
        runs: All runs.
        numbers: Means of metrics over them.
    """

    value: float
    reached: int
    runs: int
    numbers: Mapping[str, Any]

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's, 95 %."""
        return wilson(self.reached, self.runs)

    def holds(self, rate: float) -> bool:
        """Whether enough of them did."""
        return self.reached >= rate * self.runs

    def surely_holds(self, rate: float) -> bool:
        """Whether the whole interval says so."""
        return self.interval[0] >= rate

    def surely_fails(self, rate: float) -> bool:
        """Whether the whole interval says the contrary."""
        return self.interval[1] < rate


class Limit(NamedTuple):
    """What a search found; values are None where there is none.

    Attributes:
        holds_to: Largest value up to which every one that was tried holds.
        sure_to: Likewise, and is sure to.
        fails_at: Smallest that fails.
        surely_fails_at: Smallest that is sure to fail.
    """

    holds_to: float | None
    sure_to: float | None
    fails_at: float | None
    surely_fails_at: float | None


def search(test: Standard, rate: float, at: Callable[[float], Tried]) -> list[Tried]:
    """Tries values of a test's key.

    From the first on, a step at a time until one fails, and on until one is sure to; then between the last that holds
    and the first that fails, by halves, until they are a resolution apart.

    Args:
        test: What is searched.
        rate: Share of runs that must reach their goal for a value to hold.
        at: Makes the ensemble at a value.

    Returns:
        What was tried, from the easiest value outwards.
    """
    way = 1.0 if test.step > 0.0 else -1.0
    stride = round(abs(test.step) / test.resolution)
    last = round(abs(test.last - test.first) / test.resolution)
    tried: dict[int, Tried] = {}

    def holds(i: int) -> bool:
        if i not in tried:
            tried[i] = at(round(test.first + way * i * test.resolution, 12))
        return tried[i].holds(rate)

    held, place = -1, 0
    while holds(place):
        held = place
        if place == last:
            return _in_order(tried)
        place = min(place + stride, last)
    failed = place
    for _ in range(BEYOND):
        if tried[place].surely_fails(rate) or place == last:
            break
        place = min(place + stride, last)
        holds(place)
    while held >= 0 and failed - held > 1:
        middle = (held + failed) // 2
        held, failed = (middle, failed) if holds(middle) else (held, middle)
    return _in_order(tried)


def _in_order(tried: Mapping[int, Tried]) -> list[Tried]:
    return [tried[i] for i in sorted(tried)]


def limit(tried: list[Tried], rate: float) -> Limit:
    """The limit that ensembles, from the easiest value outwards, show."""
    holds_to = sure_to = fails_at = None
    sure = True
    for one in tried:
        if not one.holds(rate):
            fails_at = one.value
            break
        holds_to = one.value
        sure = sure and one.surely_holds(rate)
        sure_to = one.value if sure else sure_to
    surely = next((one.value for one in tried if one.surely_fails(rate)), None)
    return Limit(holds_to, sure_to, fails_at, surely)
