"""Endings of some runs that fell in a campaign: their last seconds are kept, and the commands that make them again.

Of millions nobody looks at all. Which ones are kept depends on the rows alone, not on who made them when; they are made
again, which is exact.
"""

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from biped.ensemble.backend import Jobs, at_most
from biped.ensemble.campaign import run_one
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.executor import workers
from biped.ensemble.failures import FAILURES, SUFFIX, keep, save_packed
from biped.ensemble.folder import Folder
from biped.ensemble.plan import Plan
from biped.ensemble.rows import RAISED
from biped.measure.metrics.walking import outcome
from biped.scenario.laws import own_law

LAST_SECONDS = 3.0
"""[s] of trajectory kept of a run that fell in a campaign."""
POINTS = 100
"""Most points of a sweep of which any are kept: so many, evenly spread."""


class LastSeconds(NamedTuple):
    """The end of a run.

    Attributes:
        index: Its number.
        cause: What became of it.
        data: Its last seconds, as a file.
        traceback: Of a law of the user's own that raised.
    """

    index: int  # pyright: ignore[reportIncompatibleMethodOverride]
    cause: str
    data: bytes
    traceback: str


class Endings:
    """Makes runs of a plan again for their last seconds.

    Args:
        plan: The campaign.
    """

    def __init__(self, plan: Plan):
        self._plan = plan

    def __call__(self, index: int) -> LastSeconds:
        """The end of run `index`."""
        trajectory, row = run_one(self._plan, index)
        with tempfile.TemporaryDirectory(prefix="biped-") as folder:
            path = Path(folder) / f"ending{SUFFIX}"
            save_packed(trajectory.last(LAST_SECONDS), path)
            return LastSeconds(index, outcome(row.as_dict()), path.read_bytes(), trajectory.traceback)


def chosen(plan: Plan, rows: StoredRows) -> Iterator[int]:
    """Numbers of the runs to keep: the first few that fell or are doubtful at each of some points."""
    most, runs, points = plan.scenario.failures.keep, plan.scenario.randomise.runs, len(plan.points)
    looked_at = {i * points // min(points, POINTS) for i in range(min(points, POINTS))}
    at, found = -1, 0
    for columns in batches(rows, ("index", "fell", "doubtful", "end")):
        for index in columns["index"][columns["fell"] | columns["doubtful"] | (columns["end"] == RAISED)]:
            point = int(index) // runs
            at, found = point, found if point == at else 0
            if found < most and point in looked_at:
                found += 1
                yield int(index)


def keep_some(plan: Plan, rows: StoredRows, where: Folder, jobs: Jobs) -> None:
    """Keeps the last seconds of some runs, and the commands that make them again.

    Args:
        plan: The campaign.
        rows: What came of it.
        where: Its results folder.
        jobs: Who makes them.

    Raises:
        RunError: They cannot be written.
    """
    kept = where.path / FAILURES
    left = [index for index in chosen(plan, rows) if not (kept / f"run-{index:05d}.txt").exists()]
    more = " --trust" if own_law(plan.scenario.law) else ""
    with workers(Endings(plan), at_most(jobs, len(left))) as carried_out:
        for ending in carried_out(left, lost=_nothing):
            if ending is not None:
                keep(where.path, ending.index, ending.cause, partial(_write, data=ending.data), more, ending.traceback)


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)


def _nothing(index: int, error: BaseException) -> Any:
    """Keeps nothing of a run that cost too many workers."""
