"""Two results side by side, run by run, and the verdict on the second; or two gaits or laws.

For gaits and laws a scenario is run with each, as often as it says or until it is decided.
"""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from biped.base.errors import InputError
from biped.base.files import is_file, label, locate, nearest
from biped.base.statistics import BETTER, UNDECIDED, Rates, SequentialTest, decided
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.folder import Folder, result_in
from biped.ensemble.guard import new_folder
from biped.measure.metrics.walking import outcome
from biped.scenario.general import read_by
from biped.scenario.laws import BUILT_IN, is_card, named_now
from biped.scenario.metrics import METRICS
from biped.scenario.vary import setting
from biped.studies.diff import changes as changed
from biped.studies.entrants import entrant_of
from biped.studies.folders import RUNS
from biped.studies.run import plan_of, run, run_first, title_of, write_results


class Point(NamedTuple):
    """One point of a sweep that both have.

    Attributes:
        values: What was swept, by key.
        pairs: Number of pairs.
        first: How many of the first walked.
        second: How many of the second.
    """

    values: dict[str, Any]
    pairs: int
    first: int
    second: int


class Difference(NamedTuple):
    """Everything that two results say about one another.

    Attributes:
        first: The result that is compared with.
        second: The one that is judged.
        pairs: Runs of the same seed at the same point of a sweep: (first, second).
        margin: See `MARGIN`.
        changes: Every metric, in the order of every table.
        points: Those of a sweep.
        settings: Keys of the scenarios that differ: (key, first's value, second's value).
        headline: Names of the metrics that decide whether it became worse.
        decision: Of a sequential test, whose pairs these are.
    """

    first: changed.ComparedSide
    second: changed.ComparedSide
    pairs: changed.Pairs
    margin: float
    changes: list[changed.MetricChange]
    points: list[Point]
    settings: list[tuple[str, Any, Any]]
    headline: tuple[str, ...] = changed.HEADLINE
    decision: SequentialTest | None = None

    @property
    def identical(self) -> bool:
        """Whether every pair's numbers are the same to the last digit."""
        return _identical(self.pairs)

    @property
    def worse(self) -> list[str]:
        """Names of the metrics of the headline that became worse."""
        return [change.name for change in self.deciding if change.verdict == changed.WORSE]

    @property
    def deciding(self) -> list[changed.MetricChange]:
        """Changes of the headline, in its order."""
        found = {change.name: change for change in self.changes}
        return [found[name] for name in self.headline if name in found]

    @property
    def passed(self) -> bool:
        """Whether nothing became worse."""
        return not self.worse

    @property
    def lost(self) -> list[changed.Row]:
        """Runs of the second that no longer walk although the first's do, the earliest end first."""
        gone = [b for a, b in self.pairs if a["walked"] and not b["walked"]]
        return sorted(gone, key=lambda run: (run["time"], run["index"]))

    @property
    def worst(self) -> changed.Row | None:
        """The run of the second to look at: the first of those that are lost, or the one that walks dearest."""
        if self.lost:
            return self.lost[0]
        dearer = [
            (b["cost_of_transport"] - a["cost_of_transport"], -b["index"], b)
            for a, b in self.pairs
            if changed.exists(a["cost_of_transport"]) and changed.exists(b["cost_of_transport"])
        ]
        return max(dearer, key=lambda found: found[:2])[2] if dearer else None

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        sides = {
            which: {
                "name": side.name, "folder": str(side.folder), "scenario": side.result["scenario"],
                "runs": len(side.result["runs"]), "summary": side.result["summary"],
            }
            for which, side in (("first", self.first), ("second", self.second))
        }  # fmt: skip
        return {
            "passed": self.passed,
            "identical": self.identical,
            "pairs": len(self.pairs),
            "margin": self.margin,
            "level": changed.LEVEL,
            **sides,
            "worse": self.worse,
            "headline": list(self.headline),
            "sequential": None if self.decision is None else self.decision.as_dict(),
            "metrics": {
                c.name: {
                    "first": c.first, "second": c.second, "pairs": c.pairs, "change": c.estimate.change,
                    "interval": [c.estimate.low, c.estimate.high], "p": c.estimate.p, "adjusted_p": c.adjusted,
                    "better": c.metric.better, "verdict": c.verdict,
                }
                for c in self.changes
            },
            "points": [point._asdict() for point in self.points],
            "settings": [{"key": key, "first": a, "second": b} for key, a, b in self.settings],
            "worst": self.worst_as_dict(),
            "seeds": [
                {"seed": a.get("seed"), "first": a["index"], "second": b["index"], "walked": [a["walked"], b["walked"]]}
                for a, b in self.pairs
            ],
        }  # fmt: skip

    def worst_as_dict(self) -> dict[str, Any] | None:
        """The run to look at, and the command that makes it again."""
        run = self.worst
        if run is None:
            return None
        again = self.second.replay(run["index"])
        return {"index": run["index"], "seed": run.get("seed"), "outcome": outcome(run), "again": again}


def differ(
    first: changed.ComparedSide, second: changed.ComparedSide, margin: float = changed.MARGIN, only: Sequence[str] = ()
) -> Difference:
    """Compares two results.

    Args:
        first: What is compared with.
        second: What is judged.
        margin: See `MARGIN`.
        only: Metrics that are compared; default: all.

    Raises:
        InputError: They have no runs in common, a metric is unknown, or the margin makes no sense.
    """
    if not 0.0 <= margin < 1.0:
        raise InputError(f"--margin {margin:g}: expected a share, 0 … 1")
    for name in only:
        if name not in METRICS:
            raise InputError(f"--metrics {name}: unknown metric; {nearest(name, list(METRICS))}")
    pairs = changed.pairs_of(first, second)
    changes = [changed.change_of(metric, pairs) for metric in METRICS.values() if not only or metric.name in only]
    headline = tuple(only) or changed.HEADLINE
    changes = changed.judged(changes, margin, headline)
    if _identical(pairs):
        changes = [change._replace(verdict=changed.SAME) for change in changes]
    points, settings = _points(pairs, changed.swept(first)), changed.settings(first, second)
    return Difference(first, second, pairs, margin, changes, points, settings, headline)


def _points(pairs: changed.Pairs, keys: Sequence[str]) -> list[Point]:
    found: dict[str, Point] = {}
    for a, b in pairs if keys else ():
        values = {key: a["values"].get(key) for key in keys}
        at = found.get(repr(values)) or Point(values, 0, 0, 0)
        found[repr(values)] = Point(
            values, at.pairs + 1, at.first + bool(a["walked"]), at.second + bool(b["walked"])
        )  # fmt: skip
    return list(found.values())


def _identical(pairs: changed.Pairs) -> bool:
    return all(_numbers(a) == _numbers(b) for a, b in pairs)


def _numbers(run: changed.Row) -> bytes:
    """Keys that two runs must share to be the same run."""
    return msgspec.json.encode({name: run.get(name) for name in (*METRICS, "fell", "end", "cause", "verdict", "doubt")})


def of_folders(first: Path, second: Path, margin: float = changed.MARGIN, only: Sequence[str] = ()) -> Difference:
    """Compares two results folders, whatever made them: gaits, laws, scenarios or versions.

    Raises:
        InputError: One is not a whole result, or see `biped.studies.diff.differ`.
    """
    if first.resolve() == second.resolve():
        raise InputError(f"{label(second)}: is the same folder as {label(first)}; expected two")
    before, after = (changed.side(label(folder), folder, result_in(folder)) for folder in (first, second))
    return differ(before, after, margin, only)


BATCH = 10
"""Pairs that are made before the sequential test looks at them."""


def of_controllers(
    first: str, second: str, scenario: str, changes: Sequence[str], jobs: Jobs, out: Path | None,
    margin: float = changed.MARGIN, only: Sequence[str] = (), progress: Progress = silent, tell: Told = unheard,
) -> tuple[Difference, Path]:  # fmt: skip
    """Runs a scenario with each of two gaits or laws and compares.

    Args:
        first: What is compared with: a gait's name or path, a law, `path.py:Class`, or a policy's card.
        second: What is judged.
        scenario: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.
        out: Folder in which each gets a results folder of its own, `first` and `second`; default: a new one below
            runs/. A campaign that was interrupted in it goes on.
        margin: See `MARGIN`.
        only: Metrics that are compared; default: all.
        progress: Told of every finished run.
        tell: Told what of an interrupted campaign could not be used.

    Returns:
        The difference and the folder.

    Raises:
        InputError: Something the user wrote cannot be used.
    """
    asked, where = _named(first, second, scenario, changes, out)
    for one in asked:
        plan_of(scenario, one)  # complaints come before the first campaign
    sides: list[changed.ComparedSide] = []
    for word, name, one in zip((first, second), ("first", "second"), asked, strict=True):
        done = run(scenario, one, jobs, where / name, progress=progress, tell=tell)
        sides.append(changed.side(word, where / name, done.result))
    return differ(sides[0], sides[1], margin, only), where


def _named(
    first: str, second: str, scenario: str, changes: Sequence[str], out: Path | None
) -> tuple[list[list[str]], Path]:
    """The changes that take each of two gaits or laws, and the folder of their results.

    Raises:
        InputError: They are one.
    """
    law = plan_of(scenario, changes).scenario.law
    named = [_changes(word, law, scenario, changes) for word in (first, second)]
    if named[0] == named[1]:
        raise InputError(f"{second}: is what it is compared with; expected two gaits or laws")
    where = new_folder(RUNS, f"diff-{Path(first).stem}-{Path(second).stem}") if out is None else out
    return named, where


def until_decided(
    first: str, second: str, scenario: str, changes: Sequence[str], jobs: Jobs, out: Path | None, rates: Rates,
    most: int, margin: float = changed.MARGIN, progress: Progress = silent, tell: Told = unheard,
) -> tuple[Difference, Path]:  # fmt: skip
    """Runs a scenario with each of two gaits or laws, pair by pair, until it is decided which walks more often.

    Whether one walked is decided by the sequential test alone; speed and cost are compared over its pairs. The folders
    are those of campaigns of `most` runs that are not finished.

    Args:
        first: See `of_controllers`.
        second: See there.
        scenario: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes.
        out: Folder; what was interrupted in it goes on.
        rates: Errors that the test may make.
        most: Pairs at most.
        margin: See `MARGIN`.
        progress: Told of every finished run.
        tell: Told what of an interrupted command could not be used.

    Raises:
        InputError: Something the user wrote cannot be used.
    """
    _check_sequential(jobs, rates, most)
    named, where = _named(first, second, scenario, [*changes, f"randomise.runs={most}"], out)
    plans = [plan_of(scenario, one) for one in named]
    if plans[0].scenario.sweep:
        raise InputError("--sequential: expected no sweep: one question is asked, not one at every point")
    test, count, made = SequentialTest(rates), 0, []
    words = ("first", "second")
    with ExitStack() as stack:
        folders = [stack.enter_context(Folder(where / word, plan)) for word, plan in zip(words, plans, strict=True)]
        while test.decision == UNDECIDED and count < most:
            count = min(most, count + BATCH)
            made = [
                run_first(folder, plan, count, f"{title_of(scenario)}, {word}", jobs, progress, tell)
                for folder, plan, word in zip(folders, plans, words, strict=True)
            ]
            test = decided(((a.walked, b.walked) for a, b in zip(*(one.rows for one in made), strict=True)), rates)
        for folder, one in zip(folders, made, strict=True):
            write_results(folder, one, None)
    sides = [
        changed.side(word, where / name, one.result)
        for word, name, one in zip((first, second), words, made, strict=True)
    ]
    found = differ(sides[0], sides[1], margin)
    changes_now = [
        change._replace(verdict=_by_test(test), adjusted=math.nan) if change.name in ("walked", "falls") else change
        for change in found.changes
    ]
    return found._replace(changes=changes_now, decision=test), where


def _by_test(test: SequentialTest) -> str:
    return {BETTER: BETTER, changed.WORSE: changed.WORSE, changed.SAME: changed.SAME}.get(test.decision, changed.UNSAID)


def _check_sequential(jobs: Jobs, rates: Rates, most: int) -> None:
    if not isinstance(jobs, int):
        raise InputError("--sequential: expected without --cluster: pairs are made a few at a time")
    if not 0.0 < rates.error < 0.5:
        raise InputError(f"--error {rates.error:g}: expected a probability below one half, such as 0.05")
    if not 1.0 < rates.ratio <= 1000.0:
        raise InputError(f"--ratio {rates.ratio:g}: expected more than 1, such as 3: how many times as often one must "
                         "walk where the other does not")  # fmt: skip
    if most < 2 * BATCH:
        raise InputError(f"--most {most}: expected at least {2 * BATCH} pairs")


def _changes(word: str, law: str | None, scenario: str, changes: Sequence[str]) -> list[str]:
    """All `--set` changes that put a gait or a law into a scenario of this law.

    A policy's card takes the place of a gait as in `biped standard`. "stand" is a law where the scenario has one.
    """
    if is_card(word) and is_file(Path(word)) and (entrant := entrant_of(word)).law:
        of_gaits = "controller" in read_by(law)[""]
        return entrant.all_changes(scenario, changes) if of_gaits else [*changes, setting("law", entrant.word)]
    if ".py:" in word or word.endswith(".onnx") or (law is not None and named_now(word) in BUILT_IN):
        return [*changes, setting("law", word)]
    path = locate("controllers", word, "diff")
    return [*changes, setting("controller", f"{path.resolve()}" if word.endswith(".toml") else word)]
