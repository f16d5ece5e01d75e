"""The folder that a run or campaign leaves behind, and the result object that `--json` prints.

scenario.toml     the effective scenario: running it gives the same results
result.json       verdict, checks, summary and every run's numbers
runs.jsonl        rows as they were finished (a campaign's journal; it resumes from here)
runs.parquet      one row per run, in order, with every metric
trajectory.npz    the trajectory of a single run
failures/         of a campaign: the last seconds of runs that fell
recording.rrd     for the rerun viewer
figures/          PNG
"""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biped.base.errors import InputError
from biped.base.statistics import wilson
from biped.ensemble.campaign import Row
from biped.ensemble.checks import Check, judge
from biped.ensemble.plan import Plan
from biped.ensemble.sweeps import by_point, thresholds
from biped.measure.metrics import NAMES, aggregate
from biped.scenario.reading import to_toml

if TYPE_CHECKING:
    import pyarrow


class Folder:
    """A results folder; `discard` it if nothing came of the run.

    Args:
        path: Where.
        plan: What is run; its effective scenario identifies the folder.

    Raises:
        InputError: Something else is already there, or it cannot be written.
    """

    def __init__(self, path: Path, plan: Plan):
        self.path = path
        self._text = to_toml(plan.scenario)
        if path.exists() and (not path.is_dir() or any(path.iterdir())):
            there = path / "scenario.toml"
            if not there.is_file() or there.read_text(encoding="utf-8") != self._text:
                raise InputError(
                    f"--out {path}: already holds something else; expected a new folder, or one with the results of "
                    "exactly this scenario, which are then continued"
                )
        self._new = not path.exists() or not any(path.iterdir())
        self._made = [folder for folder in (path, *path.parents) if not folder.exists()]
        try:
            path.mkdir(parents=True, exist_ok=True)
            (path / "scenario.toml").write_text(self._text, encoding="utf-8")
        except OSError as error:
            self.discard()
            why = str(error.strerror).lower()
            raise InputError(f"--out {path}: cannot be written: {why}; choose another folder") from None

    def discard(self) -> None:
        """Leaves things as they were before this command: removes what it wrote and the folders it made."""
        if not self._new:
            return
        for inside in self.path.iterdir() if self.path.is_dir() else ():
            if inside.is_dir():
                shutil.rmtree(inside, ignore_errors=True)
            else:
                inside.unlink(missing_ok=True)
        for folder in self._made:
            if folder.is_dir() and not any(folder.iterdir()):
                folder.rmdir()

    @property
    def journal(self) -> Path:
        """The file of finished rows."""
        return self.path / "runs.jsonl"

    def note(self, row: Row) -> None:
        """Adds a finished row to the journal, safely on disk when this returns to the system."""
        with open(self.journal, "a", encoding="utf-8") as file:
            file.write(dumps(row) + "\n")

    def finished(self) -> list[Row]:
        """Rows of runs that an earlier, interrupted campaign finished."""
        if not self.journal.is_file():
            return []
        rows, whole = [], ""
        text = self.journal.read_text(encoding="utf-8")
        for line in text.splitlines(keepends=True):
            # The line that was being written when the campaign was killed goes; the next would be glued to it.
            if line.endswith("\n"):
                rows.append(_with_nan(json.loads(line)))
                whole += line
        if whole != text:
            self.journal.write_text(whole, encoding="utf-8")
        return rows

    def write_result(self, result: dict[str, Any]) -> None:
        """Writes result.json."""
        (self.path / "result.json").write_text(dumps(result, indent=1), encoding="utf-8")

    def write_table(self, rows: Sequence[Row]) -> None:
        """Writes runs.parquet, one flat row per run."""
        import pyarrow.parquet

        pyarrow.parquet.write_table(table_of(rows), self.path / "runs.parquet")


def table_of(rows: Sequence[Row]) -> pyarrow.Table:
    """Rows as an Arrow table: one flat row each; what a row lacks is null."""
    import pyarrow

    flat = [_flat(row) for row in rows]
    names = list(dict.fromkeys(name for row in flat for name in row))
    return pyarrow.table({name: [row.get(name) for row in flat] for name in names})


def new_folder(root: Path, name: str) -> Path:
    """The first of root/name, root/name-2, … that does not exist."""
    path, number = root / name, 1
    while path.exists():
        number += 1
        path = root / f"{name}-{number}"
    return path


def result_of(name: str, plan: Plan, rows: Sequence[Row]) -> dict[str, Any]:
    """The result object of a scenario: verdict, checks, summary, runs.

    It passes when all expectations hold; without expectations, when no run diverged and a single run stayed up.
    """
    summary = aggregate([row | {"falls": row["fell"]} for row in rows])
    checks: list[Check] = judge(plan.scenario.expect, summary)
    diverged = any(row["end"] == "diverged" for row in rows)
    lone_fall = not checks and len(rows) == 1 and rows[0]["fell"]
    low, high = wilson(int(summary["walked"]), len(rows))
    points = by_point(plan.scenario, rows) if plan.scenario.sweep else []
    swept = {"points": points, "thresholds": thresholds(plan.scenario, points)} if points else {}
    return {
        "scenario": name,
        "engine": plan.scenario.engine,
        "passed": all(check.passed for check in checks) and not diverged and not lone_fall,
        "summary": {name: summary[name] for name in NAMES} | {"runs": len(rows), "walked_interval": [low, high]},
        "thesis": plan.scenario.thesis,
        "runs": list(rows),
        "checks": [check._asdict() for check in checks],
        **swept,
    }


def dumps(value: Any, indent: int | None = None) -> str:
    """JSON of a result; a number that does not exist is null."""
    return json.dumps(_without_nan(value), indent=indent, ensure_ascii=False, allow_nan=False)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _with_nan(row: Row) -> Row:
    return {key: math.nan if inner is None else inner for key, inner in row.items()}


def _flat(row: Row) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, dict):
            if key == "warnings":
                flat[key] = json.dumps(value, sort_keys=True)
            else:
                flat |= {f"{key}.{inner}": item for inner, item in _flat(value).items()}
        else:
            flat[key] = value
    return flat
