"""Recorded numbers: what every scenario gave, since when, why it changed, on which platform; and runs against them.

Runs give the same digits, the same physics, or neither. A fixed, seeded part of every scenario is run, two minutes of
walking: at most twelve runs, those of a campaign spread evenly over the points of its sweep. A scenario of one run is
one start of a chaotic system: where bits differ, even its fall says nothing. It becomes an ensemble: run 0 is the
scenario itself, the others start up to a few milliradians beside it.
"""

import json
import math
import os
from collections.abc import Callable, Sequence
from functools import partial
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from msgspec import Struct, field

from biped.base.errors import InputError
from biped.base.files import folder, label
from biped.base.statistics import same_rate
from biped.base.typed import convert
from biped.ensemble import campaign
from biped.ensemble.backend import Jobs, at_most
from biped.ensemble.executor import workers
from biped.ensemble.plan import Plan
from biped.ensemble.rows import RAISED, Row
from biped.measure.trajectory import Trajectory
from biped.scenario.metrics import HEAD
from biped.scenario.randomise import Distribution
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
        runs: Numbers of the runs, in the ensemble that `biped.studies.regress.references` makes of the scenario.
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


SECONDS = 120.0
"""Most seconds of walking per scenario."""
MOST = 12
"""Most runs per scenario."""
JITTER = 0.002
"""[rad], std of the starts of a scenario that has one start: as in the thesis's programme here."""


def ensemble(plan: Plan) -> Plan:
    """The plan itself if it is one of many runs; otherwise many starts of its run, the first its own."""
    if len(plan) > 1:
        return plan
    s = plan.scenario
    random = msgspec.structs.replace(s.randomise, runs=MOST)
    if s.start.jitter == 0.0 and "start.jitter" not in random.draw:
        starts = Distribution(grid=(0.0, *(JITTER,) * (MOST - 1)))
        random = msgspec.structs.replace(random, draw=random.draw | {"start.jitter": starts})
    return Plan(msgspec.structs.replace(s, randomise=random), plan.origin)


def chosen(plan: Plan) -> list[int]:
    """Numbers of the runs to make: spread over the points of the sweep, at each the first of its ensemble in turn."""
    count = max(1, min(MOST, int(SECONDS / plan.scenario.duration), len(plan)))
    points, runs = len(plan.points), plan.scenario.randomise.runs
    return sorted(i * points // count * runs + i % runs for i in range(count))


def measured(plan: Plan, jobs: Jobs, date: str, platform: str, advance: Callable[[], None]) -> RecordedScenario:
    """Makes the chosen runs of an `ensemble`.

    Args:
        plan: The ensemble.
        jobs: Number of processes, or a cluster.
        date: Of today.
        platform: Key of this platform.
        advance: Called after every run.
    """
    numbers = chosen(plan)
    rows, digests = [], []
    with workers(partial(_run, plan), at_most(jobs, len(numbers))) as made:
        for row, name in made(numbers):
            rows.append(row)
            digests.append(name)
            advance()
    return RecordedScenario(
        since=date,
        platform=platform,
        runs=numbers,
        ends="".join(_letter(row) for row in rows),
        digests=digests,
        **{name: [_rounded(getattr(row, name)) for row in rows] for name in METRICS},
    )


def digest(trajectory: Trajectory) -> str:
    """A name for the bits of a run's log."""
    return blake2b(trajectory.log.tobytes(), digest_size=6).hexdigest()


def _run(plan: Plan, index: int) -> tuple[Row, str]:
    trajectory, row = campaign.run_one(plan, index)
    return row, digest(trajectory)


def _letter(row: Row) -> str:
    if row.diverged:
        return "d"
    if row.doubtful:
        return {"completed": "?", "fell": "F"}.get(row.end, "!")
    return "w" if row.walked else {"completed": "s", "fell": "f", RAISED: "!"}[row.end]


def _rounded(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


TOLERANCE = {"speed": 0.02, "cost_of_transport": 0.05, "double_support": 0.10}
"""Relative change of a mean that is never taken for one."""
ALTOGETHER = {"speed": 0.01, "cost_of_transport": 0.02, "double_support": 0.04}
"""The same for all scenarios together."""
LEAST_PAIRS = 3
"""Fewer runs that walked both times say nothing about a mean."""
UNLIKELY = 1e-3
"""Probability below which chance is no explanation of two counts, or of differences run by run."""

SAME, DIGITS, PHYSICS, RUNS, NEW, GONE = "same", "digits", "physics", "runs", "new", "gone"
COMPARED = (SAME, DIGITS, PHYSICS)
"""Verdicts on scenarios that could be compared with a reference."""


class Moved(NamedTuple):
    """A mean, then and now.

    Attributes:
        old: Over the runs that walked both times.
        new: Likewise.
        change: Relative.
        within: Whether it is within the tolerance, or chance explains it.
    """

    old: float
    new: float
    change: float
    within: bool


class ScenarioComparison(NamedTuple):
    """One scenario's comparison.

    Attributes:
        scenario: Its name.
        verdict: `same`; `digits` changed but not the physics; `physics` changed; other `runs` are made of the scenario
            now; `new`: no reference; `gone`: a reference without its scenario.
        runs: Number of runs compared.
        identical: How many have the same bits.
        walked: Counts then and now.
        fell: Counts then and now, diverged runs included.
        likely: The smaller probability that these counts have one rate each.
        metrics: Means of runs that walked both times, by name; only where there are enough.
        exact: Whether digits had to be the same.
        passed: Whether it is as it should be here.
    """

    scenario: str
    verdict: str
    runs: int
    identical: int
    walked: tuple[int, int]
    fell: tuple[int, int]
    likely: float
    metrics: dict[str, Moved]
    exact: bool
    passed: bool


def compare(name: str, old: RecordedScenario, new: RecordedScenario) -> ScenarioComparison:
    """Compares a scenario's reference with what came; digits count where both are of one platform."""
    if old.runs != new.runs:
        return missing(name, RUNS, len(new.runs))
    pairs = [i for i, ends in enumerate(zip(old.ends, new.ends, strict=True)) if ends == ("w", "w")]
    metrics = {}
    for metric in METRICS:
        both = [(getattr(old, metric)[i], getattr(new, metric)[i]) for i in pairs]
        values = [(a, b) for a, b in both if a is not None and b is not None]
        if len(values) >= LEAST_PAIRS:
            metrics[metric] = _moved(values, TOLERANCE[metric])
    identical = sum(a == b for a, b in zip(old.digests, new.digests, strict=True))
    walked, fell = (old.ends.count("w"), new.ends.count("w")), (_fell(old), _fell(new))
    likely = min(same_rate(*count, len(old.runs), len(new.runs)) for count in (walked, fell))
    exact = old.platform == new.platform
    # The digests are of trajectories: what is measured of the same trajectory may have changed too.
    numbers = all(getattr(old, part) == getattr(new, part) for part in ("ends", *METRICS))
    if identical == len(new.runs) and numbers:
        verdict = SAME
    else:
        verdict = DIGITS if likely >= UNLIKELY and all(moved.within for moved in metrics.values()) else PHYSICS
    passed = verdict == SAME or (verdict == DIGITS and not exact)
    return ScenarioComparison(name, verdict, len(new.runs), identical, walked, fell, likely, metrics, exact, passed)


def altogether(verdicts: Sequence[ScenarioComparison]) -> ScenarioComparison:
    """All compared scenarios as one: a change too small to be seen in any of them shows in their sum."""
    verdicts = compared(verdicts)
    walked = sum(v.walked[0] for v in verdicts), sum(v.walked[1] for v in verdicts)
    fell = sum(v.fell[0] for v in verdicts), sum(v.fell[1] for v in verdicts)
    now = sum(v.runs for v in verdicts)
    likely = min(same_rate(*count, now, now) for count in (walked, fell))
    metrics = {}
    for metric in METRICS:
        values = [(v.metrics[metric].old, v.metrics[metric].new) for v in verdicts if metric in v.metrics]
        if len(values) > 1:
            metrics[metric] = _moved(values, ALTOGETHER[metric])
    exact, identical = any(v.exact for v in verdicts), sum(v.identical for v in verdicts)
    if all(v.verdict == SAME for v in verdicts):
        verdict = SAME
    else:
        verdict = DIGITS if likely >= UNLIKELY and all(moved.within for moved in metrics.values()) else PHYSICS
    passed = verdict != PHYSICS
    return ScenarioComparison("altogether", verdict, now, identical, walked, fell, likely, metrics, exact, passed)


def compared(verdicts: Sequence[ScenarioComparison]) -> list[ScenarioComparison]:
    """Those of scenarios that could be compared with a reference."""
    return [v for v in verdicts if v.verdict in COMPARED]


def missing(name: str, verdict: str, runs: int) -> ScenarioComparison:
    """The verdict where there is nothing to compare: `new`, `gone` or other `runs`."""
    return ScenarioComparison(name, verdict, runs, 0, (0, 0), (0, 0), 1.0, {}, False, False)


def _fell(one: RecordedScenario) -> int:
    return sum(end in FALLEN for end in one.ends)


def _moved(values: Sequence[tuple[float, float]], tolerance: float) -> Moved:
    """A change counts if it is beyond the tolerance and beyond what the scatter of the differences explains."""
    from scipy.special import stdtrit

    old, new = (sum(side) / len(values) for side in zip(*values, strict=True))
    change = (new - old) / abs(old) if old else (0.0 if new == old else float("inf"))
    variance = sum((b - a - (new - old)) ** 2 for a, b in values) / (len(values) - 1)
    chance = float(stdtrit(len(values) - 1, 1.0 - UNLIKELY / 2)) * (variance / len(values)) ** 0.5
    return Moved(old, new, change, abs(change) <= tolerance or abs(new - old) <= chance)
