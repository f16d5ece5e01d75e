"""What is compared: results folders as they are, or two gaits or laws, with which they are made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from biped.base.errors import InputError
from biped.base.files import label, locate
from biped.base.progress import Progress, Told, silent, unheard
from biped.ensemble.backend import Jobs
from biped.ensemble.guard import new_folder
from biped.ensemble.stored import result_in
from biped.scenario.inline import setting
from biped.studies.diff.changes import MARGIN
from biped.studies.diff.sides import ComparedSide, side
from biped.studies.diff.study import Difference, differ
from biped.studies.folders import RUNS
from biped.studies.planned import plan_of
from biped.studies.run import run


def of_folders(first: Path, second: Path, margin: float = MARGIN, only: Sequence[str] = ()) -> Difference:
    """Compares two results folders, whatever made them: gaits, laws, scenarios or versions.

    Raises:
        InputError: One is not a whole result, or see `biped.studies.diff.study.differ`.
    """
    if first.resolve() == second.resolve():
        raise InputError(f"{label(second)}: is the same folder as {label(first)}; expected two")
    before, after = (side(label(folder), folder, result_in(folder)) for folder in (first, second))
    return differ(before, after, margin, only)


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
    asked = [[*changes, _setting(word)] for word in (first, second)]
    if asked[0] == asked[1]:
        raise InputError(f"{second}: is what it is compared with; expected two gaits or laws")
    for one in asked:
        plan_of(scenario, one)  # complaints come before the first campaign
    where = new_folder(RUNS, f"diff-{Path(first).stem}-{Path(second).stem}") if out is None else out
    sides: list[ComparedSide] = []
    for word, name, one in zip((first, second), ("first", "second"), asked, strict=True):
        done = run(scenario, one, jobs, where / name, progress=progress, tell=tell)
        sides.append(side(word, where / name, done.result))
    return differ(sides[0], sides[1], margin, only), where


def _setting(word: str) -> str:
    """The `--set` change that takes a gait or a law."""
    if ".py:" in word:
        return setting("law", word)
    path = locate("controllers", word, "diff")
    return setting("controller", f"{path.resolve()}" if word.endswith(".toml") else word)
