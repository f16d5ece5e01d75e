"""When a results folder is refused, and what is said where it cannot be written."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from biped.base.errors import InputError, RunError
from biped.base.files import label
from biped.base.replacing import RESULTS
from biped.base.writing import reason
from biped.ensemble.lock import NAME as LOCK
from biped.ensemble.parts import FOLDER as PARTS


def unusable(path: Path, error: Exception) -> InputError:
    """What is said of a folder that nothing can be written to."""
    return InputError(f"--out {path}: cannot be written: {reason(error)}; choose another folder")


@contextmanager
def complaining(path: Path) -> Iterator[None]:
    """Turns a refusal of the system to write a file into one paragraph.

    Raises:
        RunError: The block raised an OSError.
    """
    try:
        yield
    except OSError as error:
        try:
            name = label(path)
        except OSError:  # the working folder is gone
            name = str(path)
        raise RunError(
            f"{name}: cannot be written: {reason(error)}; finished runs are kept: once it can, the same command "
            "with --out goes on from there"
        ) from error


_STUDIED = RESULTS - {"result.json", "runs.jsonl", PARTS}
OF_RUNS = _STUDIED | {"trajectory.npz", "runs.parquet", PARTS}
"""Names that are in no folder of a search."""
OF_SEARCHES = _STUDIED | {"gait.toml", "convergence.png", "least.png"}
"""Names that are in no folder of runs."""


def holds_something_else(path: Path, text: str, foreign: frozenset[str]) -> bool:
    """Whether a folder has anything in it but the results of the scenario with this text.

    Args:
        path: The folder.
        text: The scenario.
        foreign: Names that say that another command made the folder, of the same scenario perhaps.
    """
    if not path.exists():
        return False
    there = path / "scenario.toml"
    if not path.is_dir():
        return True
    inside = {one.name for one in path.iterdir()}  # once: another command may begin at this moment
    if inside & foreign:
        return True
    if there.name in inside:
        return not there.is_file() or there.read_bytes() != text.encode()
    # A command that was killed before it wrote anything may have left these.
    return any(not name.startswith((LOCK, f".{there.name}.")) for name in inside)


def same_runs(asked: Path, path: Path, runs: Sequence[int], whole: bool) -> None:
    """Refuses to lay results of some runs of a scenario over those of others.

    Args:
        asked: The folder as it was asked for.
        path: Where it is.
        runs: Numbers of the runs.
        whole: Whether they are all of the scenario's.

    Raises:
        InputError: Others are there.
    """
    try:
        there = [run["index"] for run in json.loads((path / "result.json").read_bytes())["runs"]]
    except (OSError, ValueError, TypeError, KeyError):
        there = list(runs)
    if there != list(runs) or (not whole and any((path / name).exists() for name in ("runs.jsonl", PARTS))):
        raise InputError(f"--out {asked}: already holds other runs of this scenario; choose another folder")
