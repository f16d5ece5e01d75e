"""Results that were written once are read again: what is not whole is refused in one sentence, not halfway through."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import msgspec

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.text import why
from biped.base.typed import convert
from biped.ensemble.columns import batches
from biped.ensemble.plan import Plan
from biped.measure.metrics.walking import apart
from biped.scenario.metrics import METRICS

Number = int | float | None
Count = Annotated[int, msgspec.Meta(ge=0)]
Share = tuple[float, float]


class _Cycle(msgspec.Struct):
    cycle: str
    share: float


class _Run(msgspec.Struct):
    index: Count
    fell: bool
    walked: bool
    end: str
    cause: str
    time: int | float
    distance: Number
    warnings: dict[str, int]
    values: dict[str, Any] = {}
    leg_states: _Cycle | None = None
    per_joint: dict[str, dict[str, Number]] | None = None


class _Check(msgspec.Struct):
    name: str
    value: Number
    expected: str
    passed: bool | None
    why: str = ""


class _Point(msgspec.Struct):
    values: dict[str, Any]
    runs: Count
    walked: Count
    falls: Count
    rate: float
    interval: Share


class _Threshold(msgspec.Struct):
    key: str
    sign: int
    rate: float
    holds_to: Number
    fails_at: Number


class _Summary(msgspec.Struct):
    walked: Count
    falls: Count
    walked_interval: Share
    runs: Count = 0


class _Result(msgspec.Struct):
    """The part of a result that readers rely on; versions may add to it."""

    scenario: str
    engine: str
    passed: bool | None
    summary: _Summary
    thesis: dict[str, int | float]
    checks: list[_Check]
    points: list[_Point] = []
    thresholds: list[_Threshold] = []
    runs: Annotated[list[_Run], msgspec.Meta(min_length=1)] | msgspec.UnsetType = msgspec.UNSET


@contextmanager
def reading(file: Path, what: str, again: str) -> Iterator[None]:
    """Turns whatever is wrong with a file that was written once into one sentence.

    Args:
        file: The file.
        what: What it is expected to be, in words.
        again: The command that makes it anew.

    Raises:
        InputError: The block could not read it, or found something else.
    """
    try:
        yield
    except OSError as error:
        raise InputError(f"{label(file)}: cannot be read: {str(error.strerror).lower()}") from None
    except (ValueError, RecursionError, msgspec.MsgspecError) as error:
        raise InputError(f"{label(file)}: expected {what}: {why(error)}; make it again with: {again}") from None


def result_in(folder: Path) -> dict[str, Any]:
    """The result object in a results folder; metrics that its version did not know yet are None.

    The `runs` of a large campaign, which result.json leaves to files of their own, are
    `biped.ensemble.columns.StoredRows`.

    Raises:
        InputError: It is not there, or not whole.
    """
    file, again = folder / "result.json", folder / "scenario.toml"
    if not again.is_file():
        raise InputError(f"{label(folder)}: expected the scenario.toml of its result beside it, there is none")
    with reading(file, "the whole result of a run", f"biped run {label(again)}"):
        result = json.loads(file.read_bytes())
        read = convert(result, _Result)
        if read.runs is msgspec.UNSET and not read.summary.runs:
            raise ValueError("no runs")
        if ("points" in result) != ("thresholds" in result):
            raise ValueError("points and thresholds: expected both or neither")
        if "points" in result and not (read.points and all(point.values for point in read.points)):
            raise ValueError("points: expected values of what is swept")
        if "runs" in result:
            result["runs"] = [dict(apart(run)) for run in result["runs"]]
        for where in (result["summary"], *result.get("runs", []), *result.get("points", [])):
            _complete(where)
    if "runs" not in result:
        from biped.ensemble.columns import stored_rows

        result["runs"] = stored_rows(folder, read.summary.runs)
    return result


def _complete(numbers: dict[str, Any]) -> None:
    for name in METRICS:
        value = numbers.setdefault(name, None)
        if value is not None and not isinstance(value, int | float):
            raise ValueError(f"{name}: expected a number, got {str(value)[:40]!r}")


def of_plan(folder: Path, plan: Plan, result: dict[str, Any]) -> None:
    """Refuses a result that is not one of the scenario beside it.

    Raises:
        InputError: It has runs that the scenario has not.
    """
    last = max(int(columns["index"].max()) for columns in batches(result["runs"], ["index"]))
    if last >= len(plan):
        raise InputError(
            f"{label(folder / 'result.json')}: has a run {last}, but {label(folder / 'scenario.toml')} makes "
            f"{len(plan)}: expected both of the same run; choose another folder"
        )
