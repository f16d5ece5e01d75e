"""The cost of a campaign besides its runs: processes here against a cluster on this machine, by the clock."""

import os
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.progress import Told
from biped.ensemble.backend import Jobs
from biped.ensemble.campaign import cores, run_one
from biped.ensemble.cluster import cluster_at
from biped.studies.run import plan_of, run

SCENARIO = "robust/own"
CAMPAIGNS = ((100_000, 0.2), (20_000, 10.0))
"""Runs, and their duration [s]."""
QUICK = ((12_000, 0.2), (200, 10.0))


class CampaignCost(NamedTuple):
    """One campaign, carried out twice.

    Attributes:
        runs: How many.
        duration: [s] of each.
        here: [s] by the clock with processes here.
        cluster: [s] with `local:N`, from the call on: scheduler and workers are started within it.
        work: [s] of CPU of the processes that made the runs here, over their number.
        parent: [ms] of CPU a run of the process that commits rows, with processes here.
        same: Whether both made the same bytes.
    """

    runs: int
    duration: float
    here: float
    cluster: float
    work: float
    parent: float
    same: bool

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return self._asdict() | {"cluster_to_here": self.cluster / self.here, "here_to_work": self.here / self.work}


def measure(quick: bool, tell: Told) -> list[CampaignCost]:
    """Carries out every campaign here and on a cluster of as many workers.

    Args:
        quick: Whether to make fewer runs.
        tell: Told what begins.

    Returns:
        What they cost; meaningful on a machine that does nothing else.
    """
    return [_cost(runs, duration, tell) for runs, duration in (QUICK if quick else CAMPAIGNS)]


def _cost(runs: int, duration: float, tell: Told) -> CampaignCost:
    count = cores()
    changes = ["sweep={}", f"randomise.runs={runs}", f"duration={duration}", "start.jitter=0.002", "expect={}"]
    if duration < 5.0:
        changes.append(f"window.start={duration / 2}")
    run_one(plan_of(SCENARIO, changes), 0)  # compiled code is that of earlier runs, and is loaded
    with tempfile.TemporaryDirectory(prefix="biped-") as scratch:
        here, there = Path(scratch) / "here", Path(scratch) / "there"
        tell(f"{runs} runs of {duration:g} s: {count} processes here")
        before = os.times()
        first = _timed(changes, count, here)
        after = os.times()
        own = after.user + after.system - before.user - before.system
        children = after.children_user + after.children_system - before.children_user - before.children_system
        tell(f"{runs} runs of {duration:g} s: local:{count}")
        began = time.perf_counter()
        with cluster_at(f"local:{count}", False, tell) as cluster:
            _timed(changes, cluster, there)
        second = time.perf_counter() - began
        same = _rows(here) == _rows(there)
        return CampaignCost(runs, duration, first, second, children / count, 1e3 * own / runs, same)


def _timed(changes: list[str], jobs: Jobs, out: Path) -> float:
    began = time.perf_counter()
    run(SCENARIO, changes, jobs, out)
    return time.perf_counter() - began


def _rows(folder: Path) -> list[bytes]:
    rows = folder / "runs.parquet"
    return [path.read_bytes() for path in (folder / "result.json", *([rows] if rows.is_file() else _parts(folder)))]


def _parts(folder: Path) -> list[Path]:
    return sorted(folder.glob("parts/*.parquet"))
