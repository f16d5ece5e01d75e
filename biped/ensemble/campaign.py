"""Many runs on all cores: the same numbers for any number of jobs, every finished run kept."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from biped.ensemble.plan import Plan
from biped.ensemble.processes import FORKS, pool
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.keys import Scenario

Row = dict[str, Any]
"""One run's numbers: index, seed, what it drew, how it ended, then every metric."""

_plan: Plan | None = None
_keep: Callable[[int, Trajectory, Row], None] | None = None


def simulate(run: Run) -> Trajectory:
    """Simulates a run in the engine that its scenario names."""
    if run.scenario.engine == "home":
        from biped.engines import home as engine
    else:
        from biped.engines import mujoco as engine

    with run.origin.naming():
        return engine.simulate(run)


def run_one(plan: Plan, index: int) -> tuple[Trajectory, Row]:
    """Simulates and measures run `index` of a plan."""
    from biped.measure.metrics import measure

    run = plan.run(index)
    with np.errstate(all="ignore"):  # what blows up overflows, and is called so
        trajectory = simulate(run)
        numbers = measure(trajectory, run.scenario.interval)
    row = {
        "index": index,
        "seed": run.seed,
        "values": run.values,
        "fell": bool(numbers.pop("falls")),
        "end": trajectory.end,
        "cause": trajectory.cause,
        **numbers,
        "walked": bool(numbers["walked"]),
        "warnings": trajectory.warnings,
    }
    return trajectory, row


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def rows_of(
    plan: Plan, indices: Iterable[int], jobs: int, keep: Callable[[int, Trajectory, Row], None] | None = None
) -> Iterator[Iterator[Row]]:
    """Rows of the given runs, as they are finished.

    Args:
        plan: The ensemble.
        indices: Which runs.
        jobs: Number of processes; 1 stays in this one.
        keep: Called where the run was made with (index, trajectory, row), for what must be kept of it.

    Yields:
        An iterator over rows, in any order.
    """
    indices = list(indices)
    jobs = max(1, min(jobs, len(indices)))
    _start(plan.scenario, keep, plan)
    if jobs == 1:
        yield map(_work, indices)
        return
    with pool(jobs, _start, (plan.scenario, keep, plan if FORKS else None)) as workers:
        yield workers.imap_unordered(_work, indices)


def _start(scenario: Scenario, keep: Callable[[int, Trajectory, Row], None] | None, plan: Plan | None = None) -> None:
    global _plan, _keep
    _plan = Plan(scenario, checked=True) if plan is None else plan
    _keep = keep


def _work(index: int) -> Row:
    assert _plan is not None
    trajectory, row = run_one(_plan, index)
    if _keep is not None:
        _keep(index, trajectory, row)
    return row
