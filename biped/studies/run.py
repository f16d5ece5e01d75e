"""What the commands do, without argv and without the terminal's exit code."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import canonical, label, locate
from biped.base.json import dumps
from biped.ensemble import campaign
from biped.ensemble.folder import Folder, keep
from biped.ensemble.plan import Plan
from biped.ensemble.results import result_of, write_table
from biped.ensemble.rows import Row
from biped.measure.trajectory import Trajectory
from biped.scenario.reading import blaming, read_scenario
from biped.scenario.vary import run_seed

RUNS = Path("runs")
"""Where results go unless --out says otherwise, below the working folder."""

LAST_SECONDS = 3.0
"""[s] of trajectory kept of a run that fell in a campaign."""


def title_of(name: str) -> str:
    """A scenario's name for people and folders."""
    path = locate("scenarios", name, "scenario")
    known = canonical("scenarios", path)
    return path.stem if Path(known).suffix else known


def _keep(folder: Path, index: int, trajectory: Trajectory, row: Row) -> None:
    """Keeps the last seconds of a run that fell or is doubtful."""
    if row.fell or row.doubtful:
        keep(folder, index, row.cause, trajectory.last(LAST_SECONDS))


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
    runs = None if only is None else [only]
    where = None
    if write:
        suffix = "" if only is None else f"-run{only}"
        where = Folder.new(RUNS, title + suffix, plan, runs) if out is None else Folder(out, plan, runs)
    try:
        with blaming(name, changes):
            result = _results(title, plan, runs or range(len(plan)), jobs, where, record)
    except BaseException as error:
        # What an interrupted campaign finished is kept; half a run is not.
        if where is not None:
            where.discard()
            if where.noted and isinstance(error, InputError):
                raise InputError(f"{error}; finished runs are kept in {label(where.path)}/") from error
        raise
    if where is not None:
        where.close()
    return result, None if where is None else Path(label(where.path)), plan.scenario.description


def plan_of(name: str, changes: Sequence[str]) -> Plan:
    """Reads and plans a scenario.

    Raises:
        InputError: Something in it, or in a file that it names, cannot be used.
    """
    scenario = read_scenario(name, changes)
    with blaming(name, changes):
        return Plan(scenario)


def _results(
    title: str, plan: Plan, indices: Sequence[int], jobs: int, where: Folder | None, record: bool
) -> dict[str, Any]:
    """Makes the runs and writes what they leave."""
    from biped.show.terminal import progress

    known: dict[int, Trajectory] = {}
    if len(indices) == 1:
        trajectory, row = campaign.run_one(plan, indices[0])
        rows, known = [row], {row.index: trajectory}
        if where is not None:
            with where.saving("trajectory.npz") as part:
                trajectory.save(part)
    else:
        rows = _ensemble(plan, indices, jobs, where, partial(progress, title))
    result = result_of(title, plan, rows)
    if where is not None:
        where.save_text("result.json", dumps(result, indent=1))
        with where.saving("runs.parquet") as part:
            write_table(part, rows)
        if record:
            from biped.show.replay import record_runs

            with where.saving("recording.rrd") as part:
                record_runs(part, plan, result, known)
    return result


def _ensemble(plan: Plan, indices: Sequence[int], jobs: int, where: Folder | None, progress) -> list[Row]:
    """Rows of an ensemble in order, those an interrupted campaign left included."""
    done = _finished(plan, where) if where else {}
    left = [index for index in indices if index not in done]
    kept = partial(_keep, where.path) if where else None
    if left:
        with campaign.rows_of(plan, left, jobs, kept) as rows, progress(len(indices), len(done)) as advance:
            for row in rows:
                # What goes on from a journal must not be told from what was never stopped.
                done[row.index] = row if where is None else Row.of(where.note(row.as_dict()))
                advance()
    return [done[index] for index in indices]


def _finished(plan: Plan, where: Folder) -> dict[int, Row]:
    """Rows by number that are done with; a lost run is made again, and so is one whose seed is not the plan's."""
    seeds = [run_seed(plan.scenario.seed, number) for number in range(plan.scenario.randomise.runs)]
    rows = [Row.of(record) for record in where.finished()]
    for words in where.notes:
        print(f"biped: {words}", file=sys.stderr)
    return {
        row.index: row
        for row in rows
        if not row.lost and row.index < len(plan) and row.seed == seeds[row.index % len(seeds)]
    }


def results_at(path: Path) -> dict[str, Any]:
    """The result object in a results folder.

    Raises:
        InputError: It is not a results folder, or its result is not whole.
    """
    file = path / "result.json"
    if not file.is_file():
        known = [label(p) for p in sorted(RUNS.glob("*"))]
        raise InputError(
            f"{path}: expected a results folder (with result.json); there are: {', '.join(known) or 'none'}"
        )
    from biped.ensemble.stored import result_in

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
