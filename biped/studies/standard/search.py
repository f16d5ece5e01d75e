"""The largest value that holds, and how sure that is: a ladder from the easiest outwards, then bisection.

Ensembles are kept in a file: an interrupted table goes on where it was, and nothing is computed twice.
"""

import json
from collections.abc import Callable, Mapping
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from biped.base.errors import InputError, why
from biped.base.files import label
from biped.base.statistics import wilson
from biped.base.typed import convert
from biped.base.writing import dumps, may_fill, reason, write_text
from biped.ensemble.journal import origin_of
from biped.ensemble.plan import Plan
from biped.scenario.goals import Standard
from biped.studies.folders import writing

BEYOND = 3
"""Steps beyond the first value that fails, at most, in search of one that is sure to fail."""


class TriedValue(NamedTuple):
    """An ensemble at one value.

    Attributes:
        value: In multiples of what the test says.
        reached: Runs that did what they should.
        runs: All runs.
        numbers: Means of metrics over them.
        unsound: Runs whose numbers are doubtful or diverged: they reach nothing.
        falls: Runs that fell; None: results of an earlier version did not keep it.
    """

    value: float
    reached: int
    runs: int
    numbers: Mapping[str, Any]
    unsound: int = 0
    falls: int | None = None

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
    """The result of a search; values are None where there is none.

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


def try_values(test: Standard, rate: float, at: Callable[[float], TriedValue]) -> list[TriedValue]:
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
    tried: dict[int, TriedValue] = {}

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


def _in_order(tried: Mapping[int, TriedValue]) -> list[TriedValue]:
    return [tried[i] for i in sorted(tried)]


def limit(tried: list[TriedValue], rate: float) -> Limit:
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


FILE = "measured.json"


class _Entry(msgspec.Struct):
    reached: int
    runs: int
    numbers: dict[str, float | None]
    unsound: int = 0
    falls: int | None = None


class StoredMeasurements:
    """Ensembles by what they were made of: scenario, model, gains, kernels, machine.

    Args:
        folder: Where they are kept; made if it does not exist.

    Raises:
        InputError: What is there is something else, or cannot be written.
    """

    def __init__(self, folder: Path):
        self._file = folder / FILE
        self._kept: dict[str, Any] = {}
        may_fill(folder, "--out", (FILE, "standard.json"))
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if self._file.is_file():
                self._kept = json.loads(self._file.read_bytes())
                convert(self._kept, dict[str, _Entry])
        except OSError as error:
            raise InputError(f"--out {folder}: cannot be written: {reason(error)}; choose another folder") from None
        except (ValueError, RecursionError, msgspec.MsgspecError) as error:
            raise InputError(f"{label(self._file)}: not what biped standard keeps: {why(error)}; remove it") from None

    def get(self, plan: Plan, goal: str, value: float) -> TriedValue | None:
        """The ensemble of a plan, if it was made."""
        kept = self._kept.get(digest_of(plan, goal))
        return None if kept is None else TriedValue(value, **kept)

    def keep(self, plan: Plan, goal: str, tried: TriedValue) -> None:
        """Keeps the ensemble of a plan.

        Raises:
            InputError: It cannot be written.
        """
        self._kept[digest_of(plan, goal)] = {name: one for name, one in tried._asdict().items() if name != "value"}
        with writing(label(self._file)):
            write_text(self._file, dumps(self._kept, indent=0))


def digest_of(plan: Plan, goal: str) -> str:
    """Tells apart what is made of plans: scenario, model, gains, kernels, machine, and what is asked for."""
    origin: Mapping[str, str] = origin_of(plan)
    return blake2b(json.dumps([origin, goal], sort_keys=True).encode(), digest_size=12).hexdigest()
