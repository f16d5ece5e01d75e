"""What the commands do, without argv and without the terminal's exit code."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import canonical, label, locate
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.ensemble.results import Folder, new_folder, result_of
from biped.measure.trajectory import Trajectory
from biped.scenario.reading import read

RUNS = Path("runs")
"""Where results go unless --out says otherwise, below the working folder."""

LAST_SECONDS = 3.0
"""[s] of trajectory kept of a run that fell in a campaign."""


def title_of(name: str) -> str:
    """A scenario's name for people and folders."""
    path = locate("scenarios", name, "scenario")
    known = canonical("scenarios", path)
    return path.stem if Path(known).suffix else known


def _keep(path: Path, index: int, trajectory: Trajectory, row: campaign.Row) -> None:
    """Keeps the last seconds of a run that fell."""
    if not row["fell"]:
        return
    path.mkdir(exist_ok=True)
    trajectory.last(LAST_SECONDS).save(path / f"run-{index:05d}.npz")
    again = f"biped run {path.parent / 'scenario.toml'} --only {index}"
    (path / f"run-{index:05d}.txt").write_text(f"{row['cause']}\nagain: {again}\n", encoding="utf-8")


def run(
    name: str,
    changes: Sequence[str],
    jobs: int,
    out: Path | None,
    record: bool = False,
    only: int | None = None,
    write: bool = True,
) -> tuple[dict[str, Any], Path | None, str]:
    """Runs one scenario and writes its results.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes.
        out: Results folder; default: a new one below `RUNS`.
        record: Also write a recording.
        only: Replay just this run of the ensemble.
        write: Whether to write anything.

    Returns:
        The result object, the folder (None if nothing was written), the scenario's description.

    Raises:
        InputError: Something the user wrote cannot be used; nothing is left behind.
    """
    plan = plan_of(name, changes)
    title = title_of(name)
    if only is not None and not 0 <= only < len(plan):
        raise InputError(f"--only {only}: expected the number of a run, 0 … {len(plan) - 1}")
    where = None
    if write:
        suffix = title.replace("/", "-") + ("" if only is None else f"-run{only}")
        where = Folder(out if out is not None else new_folder(RUNS, suffix), plan)
    indices = range(len(plan)) if only is None else [only]
    try:
        result = _results(title, plan, indices, jobs, where, record)
    except BaseException as error:
        # What an interrupted campaign finished is kept; half a run, or runs of what cannot be run, are not.
        if where is not None and (isinstance(error, InputError) or not where.journal.is_file()):
            where.discard()
        raise
    return result, None if where is None else where.path, plan.scenario.description


def plan_of(name: str, changes: Sequence[str]) -> Plan:
    """Reads and plans a scenario.

    Raises:
        InputError: Something in it, or in a file that it names, cannot be used.
    """
    return Plan(*read(name, changes))


def _results(
    title: str, plan: Plan, indices: Sequence[int], jobs: int, where: Folder | None, record: bool
) -> dict[str, Any]:
    """Makes the runs and writes what they leave."""
    from biped.show.terminal import progress

    known: dict[int, Trajectory] = {}
    if len(indices) == 1:
        trajectory, row = campaign.run_one(plan, indices[0])
        rows, known = [row], {row["index"]: trajectory}
        if where is not None:
            trajectory.save(where.path / "trajectory.npz")
    else:
        rows = _ensemble(plan, indices, jobs, where, partial(progress, title))
    result = result_of(title, plan, rows)
    if where is not None:
        where.write_result(result)
        where.write_table(rows)
        if record:
            from biped.show.replay import record_runs

            record_runs(where.path / "recording.rrd", plan, result, known)
    return result


def _ensemble(plan: Plan, indices: Sequence[int], jobs: int, where: Folder | None, progress) -> list[campaign.Row]:
    """Rows of an ensemble in order, those an interrupted campaign left included."""
    done = {row["index"]: row for row in (where.finished() if where else [])}
    left = [index for index in indices if index not in done]
    keep = partial(_keep, where.path / "failures") if where else None
    if left:
        with campaign.rows_of(plan, left, jobs, keep) as rows, progress(len(indices), len(done)) as advance:
            for row in rows:
                done[row["index"]] = row
                if where is not None:
                    where.note(row)
                advance()
    return [done[index] for index in indices]


def results_at(path: Path) -> dict[str, Any]:
    """The result object in a results folder.

    Raises:
        InputError: It is not a results folder.
    """
    file = path / "result.json"
    if not file.is_file():
        known = [label(p) for p in sorted(RUNS.glob("*"))]
        raise InputError(
            f"{path}: expected a results folder (with result.json); there are: {', '.join(known) or 'none'}"
        )
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{label(file)}: expected a result in JSON: {error}") from None


def newest_recording() -> Path:
    """The recording that was written last below `RUNS`.

    Raises:
        InputError: There is none.
    """
    found = sorted(RUNS.glob("*/recording.rrd"), key=lambda path: path.stat().st_mtime)
    if not found:
        raise InputError(f"view: no recording below {RUNS}/; make one with: biped run level_normal --record")
    return found[-1]
