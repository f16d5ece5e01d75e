"""How the runs of a plan are made, in memory or in files, and what is left of them in a folder."""

import shutil
import weakref
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, NamedTuple

from biped.base.json import dumps
from biped.base.progress import Told
from biped.ensemble import campaign, failures
from biped.ensemble.backend import Jobs
from biped.ensemble.chunks import Shard
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.folder import Folder
from biped.ensemble.guard import complaining
from biped.ensemble.in_parts import LARGE, LAST_SECONDS, InParts, keep_some
from biped.ensemble.parts import FOLDER as PARTS
from biped.ensemble.parts import commit_to
from biped.ensemble.plan import Plan
from biped.ensemble.results import result_of, without_rows, write_table
from biped.ensemble.rows import RAISED, Row
from biped.measure.metrics.walking import outcome
from biped.measure.trajectory import Trajectory
from biped.scenario.laws import own_law
from biped.scenario.vary import run_seed

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
