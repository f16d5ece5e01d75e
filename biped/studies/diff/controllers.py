"""Two gaits or laws side by side: a scenario is run with each, as often as it says or until it is decided."""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from biped.base.errors import InputError
from biped.base.files import locate
from biped.base.progress import Progress, Told, silent, unheard
from biped.base.sequential import BETTER, UNDECIDED, Rates, SequentialTest, decided
from biped.ensemble.backend import Jobs
from biped.ensemble.folder import Folder
from biped.ensemble.guard import new_folder
from biped.scenario.laws import BUILT_IN
from biped.scenario.vary import setting
from biped.studies.diff.changes import MARGIN, SAME, UNSAID, WORSE, ComparedSide, side
from biped.studies.diff.study import Difference, differ
from biped.studies.folders import RUNS
from biped.studies.making import write_results
from biped.studies.planned import plan_of, title_of
from biped.studies.run import run, run_first

BATCH = 10
"""Pairs that are made before the sequential test looks at them."""


def of_controllers(
    first: str, second: str, scenario: str, changes: Sequence[str], jobs: Jobs, out: Path | None,
    margin: float = MARGIN, only: Sequence[str] = (), progress: Progress = silent, tell: Told = unheard,
) -> tuple[Difference, Path]:  # fmt: skip
    """Runs a scenario with each of two gaits or laws and compares.

    Args:
        first: What is compared with: a gait's name or path, or a law, `path.py:Class`.
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
    sides: list[ComparedSide] = []
    for word, name, one in zip((first, second), ("first", "second"), asked, strict=True):
        done = run(scenario, one, jobs, where / name, progress=progress, tell=tell)
        sides.append(side(word, where / name, done.result))
    return differ(sides[0], sides[1], margin, only), where


def _named(
    first: str, second: str, scenario: str, changes: Sequence[str], out: Path | None
) -> tuple[list[list[str]], Path]:
    """The changes that take each of two gaits or laws, and the folder of their results.

    Raises:
        InputError: They are one.
    """
    own = plan_of(scenario, changes).scenario.law is not None
    named = [[*changes, _setting(word, own)] for word in (first, second)]
    if named[0] == named[1]:
        raise InputError(f"{second}: is what it is compared with; expected two gaits or laws")
    where = new_folder(RUNS, f"diff-{Path(first).stem}-{Path(second).stem}") if out is None else out
    return named, where


def until_decided(
    first: str, second: str, scenario: str, changes: Sequence[str], jobs: Jobs, out: Path | None, rates: Rates,
    most: int, margin: float = MARGIN, progress: Progress = silent, tell: Told = unheard,
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
    sides = [side(word, where / name, one.result) for word, name, one in zip((first, second), words, made, strict=True)]
    found = differ(sides[0], sides[1], margin)
    changes_now = [
        change._replace(verdict=_by_test(test), adjusted=math.nan) if change.name in ("walked", "falls") else change
        for change in found.changes
    ]
    return found._replace(changes=changes_now, decision=test), where


def _by_test(test: SequentialTest) -> str:
    return {BETTER: BETTER, WORSE: WORSE, SAME: SAME}.get(test.decision, UNSAID)


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


def _setting(word: str, own: bool) -> str:
    """The `--set` change that takes a gait or a law; "stand" is a law where the scenario has one of its `own`."""
    if ".py:" in word or word.endswith(".onnx") or (own and word in BUILT_IN):
        return setting("law", word)
    path = locate("controllers", word, "diff")
    return setting("controller", f"{path.resolve()}" if word.endswith(".toml") else word)
