"""Every test of the family with every gait: what `biped standard` finds."""

import json
import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from msgspec.structs import replace

from biped.base.errors import InputError, RunError, safe
from biped.base.files import label, names, nearest
from biped.ensemble.backend import Jobs, Progress, silent
from biped.ensemble.checks import words_of
from biped.ensemble.plan import Plan
from biped.ensemble.rows import LOST
from biped.robot.ground import GRAVITY
from biped.scenario.goals import Bound, Standard, share_of
from biped.scenario.metrics import METRICS
from biped.scenario.reading import read_scenario
from biped.studies.entrants import Entrant, entrant_of
from biped.studies.run import plan_of, run_plan, title_of
from biped.studies.standard.search import Limit, StoredMeasurements, TriedValue, limit, try_values

TABLE = "standard.json"
"""File of a table."""
FAMILY = "standard/"
"""Where the shipped tests are, below scenarios/."""


class StandardTrial(NamedTuple):
    """A test of the family.

    Attributes:
        name: Of its scenario, for people.
        scenario: Name or path of that.
        standard: What is searched and shown.
        rate: Share of runs that must reach the goal.
        description: Of its scenario.
        expect: What its scenario expects.
    """

    name: str
    scenario: str
    standard: Standard
    rate: float
    description: str
    expect: Mapping[str, Bound]


class StandardResult(NamedTuple):
    """How a gait stood a test.

    Attributes:
        test: Name of the test.
        gait: What people call the gait.
        tried: Ensembles from the easiest value outwards, or the only one; empty where the test is not for the gait.
        limit: Of a test that is searched.
        scale: What values are multiplied by for SI units.
    """

    test: str
    gait: str
    tried: list[TriedValue]
    limit: Limit | None
    scale: float

    @property
    def best(self) -> TriedValue | None:
        """The ensemble at the largest value that holds, or the only one."""
        if self.limit is None:
            return self.tried[0] if self.tried else None
        return next((one for one in self.tried if one.value == self.limit.holds_to), None)

    def as_dict(self) -> dict[str, Any]:
        """The record of an ensemble in the file."""
        return {
            "test": self.test,
            "gait": self.gait,
            "scale": self.scale,
            "tried": [one._asdict() | {"interval": list(one.interval)} for one in self.tried],
            "limit": None if self.limit is None else self.limit._asdict(),
        }


class StandardTable(NamedTuple):
    """All tests with all gaits.

    Attributes:
        tests: Rows.
        gaits: Columns.
        changes: `--set` changes, of every run.
        standings: By test, then by gait.
        asked: Gaits as they were named.
        engines: In which each was tested; none: in the tests' own.
        asked_tests: Tests as they were named; none: the shipped family.
    """

    tests: list[StandardTrial]
    gaits: list[str]
    changes: list[str]
    standings: list[StandardResult]
    asked: list[str]
    engines: list[str]
    asked_tests: list[str]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it and standard.json holds it."""
        return {
            "gaits": self.gaits,
            "changes": self.changes,
            "asked": self.asked,
            "engines": self.engines,
            "asked_tests": self.asked_tests,
            "tests": [
                {
                    "name": test.name, "title": test.standard.title, "description": test.description,
                    "goal": test.standard.goal, "rate": test.rate, "key": test.standard.key, "of": test.standard.of,
                    "times": test.standard.times, "unit": test.standard.unit, "shows": list(test.standard.shows),
                    "expect": {name: _bound(bound) for name, bound in test.expect.items()},
                }
                for test in self.tests
            ],
            "standings": [standing.as_dict() for standing in self.standings],
        }  # fmt: skip


def _bound(bound: Bound) -> dict[str, Any]:
    """A bound as plain data: in words, and its ends, which of a share lie between 0 and 1; None where it has none."""
    share = isinstance(bound.min, str) or isinstance(bound.max, str)
    return {"words": words_of(bound), "share": share, "min": _end(bound.min), "max": _end(bound.max)}


def _end(end: float | str | None) -> float | None:
    return share_of(end) if isinstance(end, str) else end


def trials_of(asked: Sequence[str]) -> list[StandardTrial]:
    """The tests that are asked for, in the order of the table; none: the shipped family.

    Args:
        asked: Names or paths; one that ends in / is all tests below that folder, which is a shipped one or the user's.

    Raises:
        InputError: One is no test, or a folder has none.
    """
    words = [word for name in asked or [FAMILY] for word in (_below(name) if name.endswith("/") else [name])]
    return sorted((_test(word) for word in words), key=lambda test: test.standard.order)


def _below(name: str) -> list[str]:
    """Names or paths of the scenarios below a folder."""
    shipped = names("scenarios")
    found = [one for one in shipped if one.startswith(name)] or sorted(map(str, Path(name).rglob("*.toml")))
    if not found:
        folders = sorted({one.rpartition("/")[0] + "/" for one in shipped if "/" in one})
        raise InputError(f"--test {safe(name)}: no scenario is below it; expected a folder of scenarios; "
                         f"{nearest(name, folders)}")  # fmt: skip
    return found


def _test(name: str) -> StandardTrial:
    word = FAMILY + name if FAMILY + name in names("scenarios") else name
    scenario = read_scenario(word)
    if scenario.standard is None:
        raise InputError(f"{safe(name)}: not a standard test; expected a scenario with a table [standard]")
    asked, rate = scenario.standard, scenario.threshold.rate
    return StandardTrial(title_of(word), word, asked, rate, scenario.description, scenario.expect)


def standard(
    gaits: Sequence[str], asked: Sequence[str], changes: Sequence[str], jobs: Jobs, out: Path,
    progress: Progress = silent, engines: Sequence[str] = (), adding: bool = True,
) -> StandardTable:  # fmt: skip
    """Puts gaits to the tests.

    Args:
        gaits: Names or paths of gaits; laws for any robot, as `entrant_of` takes them.
        asked: Names of tests, or paths of scenarios; none: all that are shipped.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.
        out: Folder in which ensembles are kept; one that is there is gone on with.
        progress: Told of every finished run.
        engines: In each of which every gait is tested; none: the tests' own.
        adding: Whether a table that the folder has must be part of the new one.

    Raises:
        InputError: Something the user wrote cannot be used; said before the first run.
    """
    tests, entrants = trials_of(asked), [entrant_of(word) for word in gaits]
    shown = [entrant.name for entrant in entrants]
    twice = [gait for gait in shown if shown.count(gait) > 1]
    if twice:
        raise InputError(f"{safe(twice[0])}: expected each gait once")
    if any(change.partition("=")[0].strip() == "controller" for change in changes):
        raise InputError(
            f"controller: expected no change of it: {safe(shown[0])} takes its place; name the gait as GAIT"
        )
    if not asked:
        there = {entrant.in_space(changes) for entrant in entrants}
        tests = [test for test in tests if test.standard.space in there]
    columns = [(entrant, entrant.name, [*changes]) for entrant in entrants]
    if engines:
        columns = [(entrant, f"{name} in {engine}", [*changes, f"engine={engine}"])
                   for entrant, name, _ in columns for engine in engines]  # fmt: skip
    for test in tests:
        for entrant, _, own in columns:
            s = _required_of(test, entrant, own)
            if s is not None:
                _plan(test, entrant, own, s.first)
    if adding:
        _add_to(out, [test.name for test in tests], [name for _, name, _ in columns], changes)
    kept = StoredMeasurements(out)
    standings = [
        _stand(test, entrant, own, partial(_measure, kept, jobs, progress))._replace(gait=name)
        for test in tests
        for entrant, name, own in columns
    ]
    shown = [name for _, name, _ in columns]
    return StandardTable(tests, shown, list(changes), standings, list(gaits), list(engines), list(asked))


def _add_to(out: Path, tests: Sequence[str], columns: Sequence[str], changes: Sequence[str]) -> None:
    """Makes sure that a table of these contains the one in a folder.

    Raises:
        InputError: It would not.
    """
    try:
        old = json.loads((out / TABLE).read_bytes())
        lost = {*old["gaits"]} - {*columns}, {test["name"] for test in old["tests"]} - {*tests}
        other = old["changes"] != list(changes)
    except (OSError, ValueError, KeyError, TypeError):
        return  # there is none, or none that could be lost
    if other or any(lost):
        what = ", ".join(safe(str(one)) for one in sorted(lost[0] | lost[1])) or "other changes"
        raise InputError(f"--out {label(out)}: holds a table with {what}; expected a new folder, or the same changes "
                         "and all of its gaits and tests among those that are asked for")  # fmt: skip


def _required_of(trial: StandardTrial, entrant: Entrant, changes: Sequence[str]) -> Standard | None:
    """The requirements of a test, of a family no speed that the entrant lacks; None if it is not for the entrant."""
    test = trial.standard
    if (test.gaits and entrant.name not in test.gaits) or (test.gaits_only and entrant.law):
        return None
    ours = trial.scenario.startswith(FAMILY) or not entrant.law  # a test of one's own is for any law
    if ours and test.space != entrant.in_space(changes):
        return None
    if test.sideways and not entrant.moves_freely(trial.scenario, changes):
        return None
    if not test.family:
        return test
    speeds = entrant.speeds()
    if speeds is None or test.key is None:
        return None if speeds is None else test
    low, high = (round((speed - test.first) / test.resolution, 6) for speed in speeds)
    first = test.first + max(0, math.ceil(low)) * test.resolution
    last = min(test.last, test.first + math.floor(high) * test.resolution)
    return None if last < first else replace(test, first=round(first, 12), last=round(last, 12))


def _stand(test: StandardTrial, entrant: Entrant, changes: Sequence[str], made: Any) -> StandardResult:
    s, gait = _required_of(test, entrant, changes), entrant.name
    if s is None:
        return StandardResult(test.name, gait, [], None, 1.0)

    def at(value: float) -> TriedValue:
        title = f"{gait}, {s.title}" + (f" {value:g}" if s.key else "")
        try:
            plan = _plan(test, entrant, changes, value)
        except InputError:
            if s.key is None or value == s.first:
                raise
            return TriedValue(value, 0, runs, {})  # a value that cannot be run is one that fails
        return made(title, plan, s, value)

    runs = len(_plan(test, entrant, changes, s.first))
    if s.key is None:
        return StandardResult(test.name, gait, [at(math.nan)], None, 1.0)
    tried = try_values(s, test.rate, at)
    scale = _unit(_plan(test, entrant, changes, s.first), s.of)
    return StandardResult(test.name, gait, tried, limit(tried, test.rate), scale)


def _plan(test: StandardTrial, entrant: Entrant, changes: Sequence[str], value: float) -> Plan:
    """A test's plan with an entrant, at a value of its key in multiples of what the test says."""
    asked = entrant.all_changes(test.scenario, changes)
    s = test.standard
    plain = plan_of(test.scenario, asked)
    asked += [f"{key}={_unit(plain, 'leg') * legs:.9g}" for key, legs in s.legs.items()]
    values = {key: _unit(plain, "weight") * weights for key, weights in s.weights.items()}
    if s.key is not None:
        values[s.key] = _unit(plain, s.of) * value
    if values:  # of a sweep, which reaches into lists
        asked.append("sweep={" + ", ".join(f'"{key}"=[{one:.9g}]' for key, one in values.items()) + "}")
    return plan_of(test.scenario, asked) if s.legs or values else plain


def _unit(plan: Plan, of: str) -> float:
    return {"si": 1.0, "weight": plan.robot.mass * GRAVITY, "leg": plan.robot.leg}[of]


def _measure(
    kept: StoredMeasurements, jobs: Jobs, progress: Progress, title: str, plan: Plan, test: Standard, value: float
) -> TriedValue:
    """The ensemble of a plan, made unless it was before."""
    found = kept.get(plan, test.goal, value)
    if found is not None:
        return found
    result = run_plan(title, plan, jobs, progress).result
    if lost := [run["cause"] for run in result["runs"] if run["end"] == LOST]:
        raise RunError(
            f"{title}: {len(lost)} of {len(plan)} runs ended with their process, and count for nothing: {lost[0]}"
        )
    summary = result["summary"]
    shows = dict.fromkeys((*test.shows, "speed"))
    numbers = {name: _real(summary[name]) for name in shows if name in METRICS}
    unsound = int(summary["doubtful"]) + int(summary["diverged"])
    tried = TriedValue(value, int(summary[test.goal]), int(summary["runs"]), numbers, unsound, int(summary["falls"]))
    kept.keep(plan, test.goal, tried)
    return tried


def _real(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
