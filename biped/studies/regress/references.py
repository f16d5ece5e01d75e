"""The file of references: what every scenario gave, since when, why it changed, and on which platform."""

import json
import os
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct, field

from biped.base.errors import InputError
from biped.base.files import folder, label
from biped.base.typed import convert
from biped.scenario.metrics import HEAD
from biped.scenario.valid import humane

METRICS = HEAD
"""Numbers kept of every run."""
FALLEN = "fFd"
"""Letters of `Reference.ends` that count as falls."""


class RecordedScenario(Struct, frozen=True, forbid_unknown_fields=True):
    """Recorded numbers of one scenario.

    Attributes:
        since: Date of the change that it has been the same since; `References.history` says why.
        platform: Key of the platform that it was recorded on.
        runs: Numbers of the runs, in the ensemble that `biped.studies.regress.compare` makes of the scenario.
        ends: A letter for each: w walked, s stayed up without walking on, f fell, d diverged, ! its law failed;
            where the numbers are doubtful, F fell and ? stayed up.
        digests: Of the bits of each run's log.
        speed: [m/s] of each run; None where it has none. Likewise the other metrics.
        cost_of_transport: Net.
        double_support: Fraction.
    """

    since: str
    platform: str
    runs: list[int]
    ends: str
    digests: list[str]
    speed: list[float | None]
    cost_of_transport: list[float | None]
    double_support: list[float | None]


class TickCost(Struct, frozen=True, forbid_unknown_fields=True):
    """Cost of a tick of a scenario, as ratios to bare `mj_step` in the same process.

    Attributes:
        since: Date of the measurement.
        reason: Why it was recorded.
        loop: Physics and controller.
        metrics: The same with the metrics.
    """

    since: str
    reason: str
    loop: float
    metrics: float


class ReferenceChange(Struct, frozen=True, forbid_unknown_fields=True):
    """One update of the file.

    Attributes:
        date: Of the day.
        reason: Why results changed.
        sources: Digest of the compiled sources.
        platform: Key of the platform.
        scenarios: Names of the scenarios whose references changed; `all` if all did.
    """

    date: str
    reason: str
    sources: str
    platform: str
    scenarios: list[str]


class References(Struct, forbid_unknown_fields=True):
    """The file.

    Attributes:
        history: Changes, the newest first.
        platforms: By key, what a platform is.
        costs: By scenario.
        scenarios: By name.
    """

    history: list[ReferenceChange] = field(default_factory=list)
    platforms: dict[str, dict[str, str]] = field(default_factory=dict)
    costs: dict[str, TickCost] = field(default_factory=dict)
    scenarios: dict[str, RecordedScenario] = field(default_factory=dict)


def shipped(engine: str | None = None) -> Path:
    """The file of the shipped scenarios; of those that have references in another engine than their own, that file."""
    return folder("scenarios") / ("references.json" if engine is None else f"references_{engine}.json")


def read(path: Path) -> References:
    """Reads a file of references; one that does not exist is empty.

    Raises:
        InputError: It cannot be read or is something else.
    """
    try:
        found = convert(msgspec.json.decode(path.read_bytes()), References)
    except FileNotFoundError:
        return References()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; expected a file of references") from None
    except msgspec.DecodeError as error:
        raise InputError(
            f"{label(path)}: not a file of references: {humane(str(error))}; make one with biped regress --update"
        ) from None
    for name, one in found.scenarios.items():
        lengths = {len(one.runs), len(one.ends), len(one.digests), *(len(getattr(one, metric)) for metric in METRICS)}
        if len(lengths) > 1:
            raise InputError(f"{label(path)}: scenarios.{name}: expected lists of one length, one value a run")
    return found


def write(path: Path, references: References) -> None:
    """Writes the file, one line per list, so that a change is a readable difference; all of it or nothing.

    Raises:
        InputError: It cannot be written.
    """
    used = {one.platform for one in references.scenarios.values()} | {one.platform for one in references.history}
    data = msgspec.to_builtins(references)
    data["platforms"] = {key: value for key, value in data["platforms"].items() if key in used}
    data["scenarios"] = dict(sorted(data["scenarios"].items()))
    beside = path.with_name(f"{path.name}.new")
    try:
        beside.write_text(_lines(data, "") + "\n", encoding="utf-8")
        os.replace(beside, path)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None


def _lines(value: Any, indent: str) -> str:
    deeper = indent + " "
    if isinstance(value, dict) and value:
        inner = [f"{deeper}{json.dumps(key)}: {_lines(item, deeper)}" for key, item in value.items()]
        return "{\n" + ",\n".join(inner) + f"\n{indent}}}"
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(deeper + _lines(item, deeper) for item in value) + f"\n{indent}]"
    return json.dumps(value, ensure_ascii=False)
