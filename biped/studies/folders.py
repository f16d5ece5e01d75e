"""Where results go, and where they are found again."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import is_file, label
from biped.base.writing import reason
from biped.ensemble.backend import Told
from biped.ensemble.folder import Folder, result_in
from biped.ensemble.guard import OF_SEARCHES
from biped.ensemble.plan import Plan

RUNS = Path("runs")
"""Where results go unless --out says otherwise, below the working folder."""


@contextmanager
def writing(what: str, advice: str = "") -> Iterator[None]:
    """Turns a refusal of the system to write a file into a sentence.

    Args:
        what: Option and file, such as `--out walk.gif`.
        advice: What to do about it.

    Raises:
        InputError: The block raised an OSError.
    """
    try:
        yield
    except OSError as error:
        raise InputError(f"{what}: cannot be written: {reason(error)}{advice and f'; {advice}'}") from None


def finished(folder: Folder, tell: Told) -> dict[int, dict[str, Any]]:
    """Records of an earlier, interrupted command by their numbers; what of them cannot be used is told."""
    records = {record["index"]: record for record in folder.finished()}
    for words in folder.notes:
        tell(words)
    return records


def folder_for(out: Path | None, title: str, plan: Plan, runs: Sequence[int] | None = None,
               foreign: frozenset[str] = OF_SEARCHES) -> Folder:  # fmt: skip
    """The results folder that the user asks for, or else a new one below `RUNS`.

    Args:
        out: What the user asks for.
        title: Of a new one.
        plan: What is run.
        runs: Numbers of the runs that are made, where it is not all of the plan's.
        foreign: Names that say that another command made the folder.

    Raises:
        InputError: Something else is already there, another process is at work in it, or it cannot be written.
    """
    return Folder.new(RUNS, title, plan, runs) if out is None else Folder(out, plan, runs, foreign=foreign)


def results_at(path: Path) -> dict[str, Any]:
    """The result object in a results folder.

    Raises:
        InputError: It is not a results folder, or its result is not whole.
    """
    file = path / "result.json"
    if not is_file(file):
        known = [label(p) for p in sorted(RUNS.glob("*"))]
        raise InputError(
            f"{path}: expected a results folder (with result.json); there are: {', '.join(known) or 'none'}"
        )
    return result_in(path)


def newest_recording() -> Path:
    """The recording that was written last below `RUNS`.

    Raises:
        InputError: There is none.
    """
    found = sorted(RUNS.glob("*/recording.rrd"), key=lambda path: path.stat().st_mtime)
    if not found:
        raise InputError(f"view: no recording below {RUNS}/; make one with: biped run level_normal --record")
    return found[-1]
