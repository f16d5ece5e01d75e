"""What the commands do, without argv and without the terminal's exit code."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import canonical, label, locate
from biped.base.json import dumps
from biped.base.progress import Progress, Told, silent, unheard
from biped.ensemble import campaign
from biped.ensemble.folder import Folder, keep
from biped.ensemble.plan import Plan
from biped.ensemble.results import result_of, write_table
from biped.ensemble.rows import RAISED, Row
from biped.measure.trajectory import Trajectory
from biped.robot.given import Factory
from biped.scenario.keys import Scenario
from biped.scenario.law import digest
from biped.scenario.reading import read
from biped.scenario.valid import possible
from biped.scenario.vary import run_seed

RUNS = Path("runs")
"""Where results go unless --out says otherwise, below the working folder."""

TRACEBACK = "traceback.txt"
"""Of a single run whose law raised: where in it."""
LAST_SECONDS = 3.0
"""[s] of trajectory kept of a run that fell in a campaign."""


Recorder = Callable[[Path, Plan, dict[str, Any], dict[int, Trajectory]], None]
"""Writes a recording to a file, from the plan, its result object and trajectories that need not be made again."""


class Done(NamedTuple):
    """A scenario that was run.

    Attributes:
        result: Its result object (`biped.ensemble.results`).
        rows: Its runs' numbers.
        folder: Where its results are; None if nothing was written.
        plan: What was run.
        trajectories: Those of a single run, by its number; an ensemble's are not kept.
    """

    result: dict[str, Any]
    rows: list[Row]
    folder: Path | None
    plan: Plan
    trajectories: dict[int, Trajectory]


def title_of(name: str) -> str:
    """A scenario's name for people and folders."""
    path = locate("scenarios", name, "scenario")
    known = canonical("scenarios", path)
    return path.stem if Path(known).suffix else known


def _keep(folder: Path, index: int, trajectory: Trajectory, row: Row, more: str = "") -> None:
    """Keeps the last seconds of a run that fell, is doubtful or was ended by its law, and how to make it again."""
    if row.fell or row.doubtful or row.end == RAISED:
        keep(folder, index, row.cause, trajectory.last(LAST_SECONDS), more)


def run(
    name: str,
    changes: Sequence[str],
    jobs: int,
    out: Path | None,
    record: Recorder | None = None,
    only: int | None = None,
    write: bool = True,
    progress: Progress = silent,
    tell: Told = unheard,
) -> Done:
    """Runs one scenario and writes its results.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes.
        out: Results folder; default: a new one below `RUNS`.
        record: Writes a recording; default: none is written.
        only: Replay just this run of the ensemble.
        write: Whether to write anything.
        progress: Told of every finished run of an ensemble.
        tell: Told what of an interrupted campaign could not be used.

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
        done = _made(title, plan, runs or range(len(plan)), jobs, where, progress, tell)
        if where is not None:
            _write(where, done, record)
    except BaseException as error:
        # What an interrupted campaign finished is kept; half a run is not.
        if where is not None:
            where.discard()
            if where.noted and isinstance(error, InputError):
                raise InputError(f"{error}; finished runs are kept in {label(where.path)}/") from error
        raise
    if where is not None:
        where.close()
    return done if where is None else done._replace(folder=Path(label(where.path)))


def plan_of(name: str, changes: Sequence[str], law: Factory | None = None) -> Plan:
    """Reads and plans a scenario.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        law: A control law handed over as an object; default: what the scenario says.

    Raises:
        InputError: Something in it, or in a file that it names, cannot be used.
    """
    scenario, origin = read(name, changes)
    if law is not None:
        with origin.naming():
            scenario = with_law(scenario, law)
    return Plan(scenario, origin, law=law)


def with_law(scenario: Scenario, law: Factory) -> Scenario:
    """The scenario with the name of a law that was handed over.

    Raises:
        InputError: It asks for what only the thesis's law does.
    """
    scenario = replace(scenario, law=law.name, law_sha256=digest(law.name) if law.file and ".py:" in law.name else None)
    possible(scenario, lambda key, what: InputError(f"{key}: {what}", key))
    return scenario


def run_plan(title: str, plan: Plan, jobs: int, progress: Progress = silent) -> Done:
    """Makes all runs of a plan and writes nothing."""
    return _made(title, plan, range(len(plan)), jobs, None, progress, unheard)


def save(done: Done, path: Path) -> Path:
    """Writes what was run and not written into a results folder; returns it.

    Raises:
        InputError: The folder holds something else, or cannot be written.
    """
    where = Folder(path, done.plan)
    try:
        _write(where, done, None)
    except BaseException:
        where.discard()
        raise
    where.close()
    return where.path


def _made(
    title: str, plan: Plan, indices: Sequence[int], jobs: int, where: Folder | None, progress: Progress, tell: Told
) -> Done:
    """Makes the runs."""
    known: dict[int, Trajectory] = {}
    if len(indices) == 1:
        trajectory, row = campaign.run_one(plan, indices[0])
        rows, known = [row], {row.index: trajectory}
    else:
        rows = _ensemble(plan, indices, jobs, where, partial(progress, title), tell)
    return Done(result_of(title, plan, rows), rows, None, plan, known)


def _write(where: Folder, done: Done, record: Recorder | None) -> None:
    """Writes what runs leave; of an ensemble no trajectory."""
    if len(done.rows) == 1:
        for trajectory in done.trajectories.values():
            with where.saving("trajectory.npz") as part:
                trajectory.save(part)
            if trajectory.traceback:
                where.save_text(TRACEBACK, trajectory.traceback)
    where.save_text("result.json", dumps(done.result, indent=1))
    with where.saving("runs.parquet") as part:
        write_table(part, done.rows)
    if record is not None:
        with where.saving("recording.rrd") as part:
            record(part, done.plan, done.result, done.trajectories)


def _ensemble(
    plan: Plan, indices: Sequence[int], jobs: int, where: Folder | None, progress: Callable[..., Any], tell: Told
) -> list[Row]:
    """Rows of an ensemble in order, those an interrupted campaign left included."""
    done = _finished(plan, where, tell) if where else {}
    left = [index for index in indices if index not in done]
    kept = partial(_keep, where.path, more=" --trust" if plan.scenario.law else "") if where else None
    if left:
        with campaign.rows_of(plan, left, jobs, kept) as rows, progress(len(indices), len(done)) as advance:
            for row in rows:
                # What goes on from a journal must not be told from what was never stopped.
                done[row.index] = row if where is None else Row.of(where.note(row.as_dict()))
                advance()
    return [done[index] for index in indices]


def _finished(plan: Plan, where: Folder, tell: Told) -> dict[int, Row]:
    """Rows by number that are done with; a lost run is made again, and so is one whose seed is not the plan's."""
    seeds = [run_seed(plan.scenario.seed, number) for number in range(plan.scenario.randomise.runs)]
    rows = [Row.of(record) for record in where.finished()]
    for words in where.notes:
        tell(words)
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
