"""Runs of a plan: from what the user names to what is run, how it is run, and what is left of it in a folder."""

import shutil
import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, NamedTuple

from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import canonical, label, locate
from biped.base.writing import dumps
from biped.ensemble import campaign, failures
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.chunks import Shard
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.endings import LAST_SECONDS, keep_some
from biped.ensemble.folder import Folder
from biped.ensemble.guard import complaining
from biped.ensemble.in_parts import LARGE, InParts
from biped.ensemble.parts import FOLDER as PARTS
from biped.ensemble.parts import commit_to
from biped.ensemble.plan import Plan
from biped.ensemble.results import result_of, without_rows, write_table
from biped.ensemble.rows import RAISED, Row
from biped.measure.metrics.walking import outcome
from biped.measure.trajectory import Trajectory
from biped.robot.run import Factory
from biped.scenario.keys import Scenario
from biped.scenario.laws import digest, own_law
from biped.scenario.possible import possible
from biped.scenario.reading import read
from biped.scenario.valid import fault
from biped.scenario.vary import run_seed
from biped.studies.folders import folder_for


def title_of(name: str) -> str:
    """A scenario's name for people and folders."""
    path = locate("scenarios", name, "scenario")
    known = canonical("scenarios", path)
    return path.stem if Path(known).suffix else known


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
    possible(scenario, fault)
    return scenario


TRACEBACK = "traceback.txt"
"""Of a single run whose law raised: where in it."""

Recorder = Callable[[Path, Plan, dict[str, Any], dict[int, Trajectory]], None]
"""Writes a recording to a file, from the plan, its result object and trajectories that need not be made again."""


class Temporary:
    """A temporary folder that is removed with this object.

    Attributes:
        path: Where.
    """

    def __init__(self):
        self.path = Path(mkdtemp(prefix="biped-"))
        weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)


class ScenarioResult(NamedTuple):
    """A scenario that was run.

    Attributes:
        result: Its result object (`biped.ensemble.results`).
        rows: Its runs' numbers; those of a large campaign lie in files.
        folder: Where its results are; None if nothing was written.
        plan: What was run.
        trajectories: Those of a single run, by its number; an ensemble's are not kept.
        files: A temporary folder, of rows of a large campaign of which nothing was written; it lives as long as this.
    """

    result: dict[str, Any]
    rows: list[Row] | StoredRows
    folder: Path | None
    plan: Plan
    trajectories: dict[int, Trajectory]
    files: Temporary | None = None

    @property
    def raised(self) -> bool:
        """Whether a law of the user's own ended any of the runs."""
        if isinstance(self.rows, StoredRows):
            return any((columns["end"] == RAISED).any() for columns in batches(self.rows, ["end"]))
        return any(row.end == RAISED for row in self.rows)


class How(NamedTuple):
    """How runs are made: by whom, where they are noted, who is told."""

    jobs: Jobs
    where: Folder | None
    progress: Callable[..., Any]
    tell: Told
    same: bool


def make(title: str, plan: Plan, indices: Sequence[int], how: How) -> ScenarioResult:
    """Makes the runs."""
    if len(indices) == 1:
        trajectory, row = campaign.run_one(plan, indices[0])
        return ScenarioResult(result_of(title, plan, [row]), [row], None, plan, {row.index: trajectory})
    if how.where is None and len(indices) > LARGE:
        files = Temporary()
        rows = _finished_in_parts(plan, how, files.path)
        return ScenarioResult(result_of(title, plan, rows), rows, None, plan, {}, files)
    begun_so = how.where is not None and (how.where.path / PARTS).is_dir()
    if how.where is not None and (begun_so or len(indices) > LARGE or not isinstance(how.jobs, int)):
        rows = _finished_in_parts(plan, how, how.where.parts)
    else:
        rows = _ensemble(plan, indices, how)
    return ScenarioResult(result_of(title, plan, rows), rows, None, plan, {})


def _finished_in_parts(plan: Plan, how: How, folder: Path) -> list[Row] | StoredRows:
    """All rows of a campaign whose rows lie in files: themselves if they are few, else where they are."""
    campaign = _in_parts(plan, how, folder)
    everything = range(len(plan))
    with complaining(folder):
        _make_in_parts(campaign, everything, how)
        rows = campaign.finish()
        if how.where is not None:
            keep_some(plan, rows, how.where, how.jobs)
    return [Row.of(record) for record in rows] if len(rows) <= LARGE else rows


def _in_parts(plan: Plan, how: How, folder: Path) -> InParts:
    """The campaign in files, with what a journal holds of it."""
    where = how.where
    commit = where.commit if where is not None else partial(commit_to, folder)
    campaign = InParts(plan, folder, commit, how.tell, how.same)
    if where is not None and where.journal.is_file():
        rows = _finished(plan, where, how.tell)
        campaign.adopt([rows[index] for index in sorted(rows)])
    return campaign


def _make_in_parts(campaign: InParts, wanted: range, how: How) -> None:
    left = sum(map(len, campaign.missing(wanted)))
    if left:
        with how.progress(len(wanted), len(wanted) - left) as advance:
            campaign.make(how.jobs, wanted, advance)


def share(plan: Plan, shard: Shard, how: How, where: Folder) -> int:
    """Makes a share; returns how many runs of the campaign are missing."""
    campaign = _in_parts(plan, how, where.parts)
    with complaining(where.parts):
        _make_in_parts(campaign, shard.runs(len(plan)), how)
    return sum(map(len, campaign.missing(range(len(plan)))))


def write_results(where: Folder, done: ScenarioResult, record: Recorder | None) -> None:
    """Writes what runs leave; of an ensemble no trajectory."""
    if len(done.rows) == 1:
        for trajectory in done.trajectories.values():
            with where.saving("trajectory.npz") as part:
                trajectory.save(part)
            if trajectory.traceback:
                where.save_text(TRACEBACK, trajectory.traceback)
    if isinstance(done.rows, StoredRows):
        _adopt(where, done)
    else:
        with where.saving("runs.parquet") as part:
            write_table(part, done.rows)
    where.save_text("result.json", dumps(without_rows(done.result), indent=1))
    if record is not None:
        with where.saving("recording.rrd") as part:
            record(part, done.plan, done.result, done.trajectories)


def _adopt(where: Folder, done: ScenarioResult) -> None:
    """Takes rows over that lie in a temporary folder."""
    if done.files is not None:
        for part in sorted(done.files.path.iterdir()):
            with where.saving(f"{where.parts.name}/{part.name}") as copy:
                shutil.copyfile(part, copy)


def _ensemble(plan: Plan, indices: Sequence[int], how: How) -> list[Row]:
    """Rows of an ensemble in order, those an interrupted campaign left included."""
    where = how.where
    done = _finished(plan, where, how.tell) if where else {}
    left = [index for index in indices if index not in done]
    kept = partial(keep_ending, where.path, more=" --trust" if own_law(plan.scenario.law) else "") if where else None
    if left:
        with campaign.rows_of(plan, left, how.jobs, kept) as rows, how.progress(len(indices), len(done)) as advance:
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


def keep_ending(folder: Path, index: int, trajectory: Trajectory, row: Row, more: str = "") -> None:
    """Keeps the last seconds of a run that fell, is doubtful or was ended by its law, and how to make it again."""
    if row.fell or row.doubtful or row.end == RAISED:
        ending = partial(failures.save_packed, trajectory.last(LAST_SECONDS))
        failures.keep(folder, index, outcome(row.as_dict()), ending, more, trajectory.traceback)


class Shared(NamedTuple):
    """A share of a campaign that was made, while others are not.

    Attributes:
        scenario: Of the campaign.
        shard: Which share.
        runs: How many runs it has.
        left: How many runs of the campaign nobody has made yet.
        folder: Where they are.
    """

    scenario: str
    shard: Shard
    runs: int
    left: int
    folder: Path

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return self._asdict() | {"shard": str(self.shard), "folder": str(self.folder)}


def run(
    name: str,
    changes: Sequence[str],
    jobs: Jobs,
    out: Path | None,
    record: Recorder | None = None,
    only: int | None = None,
    write: bool = True,
    progress: Progress = silent,
    tell: Told = unheard,
    same: bool = False,
) -> ScenarioResult:
    """Runs one scenario and writes its results.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.
        out: Results folder; default: a new one below `RUNS`.
        record: Writes a recording; default: none is written.
        only: Replay just this run of the ensemble.
        write: Whether to write anything.
        progress: Told of every finished run of an ensemble.
        tell: Told what of an interrupted campaign could not be used.
        same: Whether runs that another kind of machine made are refused.

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
        where = folder_for(out, title + suffix, plan, runs)
    how = How(jobs, where, partial(progress, title), tell, same)
    with _leaving_what_counts(where):
        done = make(title, plan, runs or range(len(plan)), how)
        if where is not None:
            write_results(where, done, record)
            done = done._replace(folder=Path(label(where.path)))
    return done


def run_shard(
    name: str,
    changes: Sequence[str],
    shard: Shard,
    jobs: Jobs,
    out: Path,
    record: Recorder | None = None,
    progress: Progress = silent,
    tell: Told = unheard,
    same: bool = False,
) -> ScenarioResult | Shared:
    """Runs a share of a scenario's campaign; whoever makes the last one ends the campaign.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        shard: The share.
        jobs: Number of processes, or a cluster.
        out: Results folder, which all shares have in common.
        record: Writes a recording at the end; default: none is written.
        progress: Told of every finished run.
        tell: Told what of an interrupted campaign could not be used.
        same: Whether runs that another kind of machine made are refused.

    Returns:
        How far the campaign is; or, once nothing is missing, what `run` returns.
    """
    plan = plan_of(name, changes)
    title = title_of(name)
    where = Folder(out, plan, shard=shard)
    how = How(jobs, where, partial(progress, f"{title} {shard}"), tell, same)
    with _leaving_what_counts(where):
        left = share(plan, shard, how, where)
        if left or not where.alone():
            return Shared(title, shard, len(shard.runs(len(plan))), left, Path(label(where.path)))
        done = make(title, plan, range(len(plan)), how)
        write_results(where, done, record)
        return done._replace(folder=Path(label(where.path)))


def run_first(where: Folder, plan: Plan, count: int, title: str, jobs: Jobs, progress: Progress, tell: Told) -> (
    ScenarioResult
):  # fmt: skip
    """Makes the first runs of a plan, of which others may follow; those in the folder's journal are not repeated."""
    return make(title, plan, range(count), How(jobs, where, partial(progress, title), tell, False))


def run_plan(title: str, plan: Plan, jobs: Jobs, progress: Progress = silent) -> ScenarioResult:
    """Makes all runs of a plan and writes nothing."""
    return make(title, plan, range(len(plan)), How(jobs, None, partial(progress, title), unheard, False))


def save(done: ScenarioResult, path: Path) -> Path:
    """Writes what was run and not written into a results folder; returns it.

    Raises:
        InputError: The folder holds something else, or cannot be written.
    """
    with Folder(path, done.plan) as where:
        write_results(where, done, None)
    return where.path


@contextmanager
def _leaving_what_counts(where: Folder | None) -> Iterator[None]:
    """Closes a folder; of what an error interrupts, finished runs are kept, half a run is not."""
    try:
        with where or nullcontext():
            yield
    except InputError as error:
        if where is not None and where.noted:
            raise InputError(f"{error}; finished runs are kept in {label(where.path)}/") from error
        raise
