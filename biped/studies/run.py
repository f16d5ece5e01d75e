"""Runs of a plan with everything that belongs to them, without argv and without the terminal's exit code."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.progress import Progress, Told, silent, unheard
from biped.ensemble.backend import Jobs
from biped.ensemble.chunks import Shard
from biped.ensemble.folder import Folder
from biped.ensemble.plan import Plan
from biped.studies.folders import folder_for
from biped.studies.making import How, Recorder, ScenarioResult, make, share, write_results
from biped.studies.planned import plan_of, title_of


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
