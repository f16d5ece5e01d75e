"""Many runs on all cores: the same numbers for any number of jobs, every finished run kept."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from biped.ensemble.executor import workers
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.keys import Scenario
from biped.scenario.origin import Origin

Row = dict[str, Any]
"""One run's numbers: index, seed, what it drew, how it ended, then every metric."""

Keep = Callable[[int, Trajectory, Row], None]
"""Called where a run was made with (index, trajectory, row), for what must be kept of it."""

LOST = "lost"
"""How a run ended that cost two workers: neither walked nor fell, its numbers are nan."""


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
def rows_of(plan: Plan, indices: Iterable[int], jobs: int, keep: Keep | None = None) -> Iterator[Iterator[Row]]:
    """Rows of the given runs, as they are finished.

    Args:
        plan: The ensemble.
        indices: Which runs.
        jobs: Number of processes; 1 stays in this one.
        keep: What must be kept of a run, where it was made.

    Yields:
        An iterator over rows, in any order.
    """
    indices = list(indices)
    with workers(Making(plan, keep), min(jobs, len(indices))) as carried_out:
        yield carried_out(indices, ordered=False, lost=partial(_lost, plan))


class Making:
    """Makes runs of a plan by number, wherever it is sent to: there the plan is made anew from its scenario.

    Args:
        plan: The ensemble.
        keep: What must be kept of a run, where it was made.
    """

    def __init__(self, plan: Plan, keep: Keep | None):
        self._plan, self._keep = plan, keep

    def __call__(self, index: int) -> Row:
        """The row of run `index`."""
        trajectory, row = run_one(self._plan, index)
        if self._keep is not None:
            self._keep(index, trajectory, row)
        return row

    def __reduce__(self) -> tuple[Any, ...]:
        return _making, (self._plan.scenario, self._plan.origin, self._keep)


def _making(scenario: Scenario, origin: Origin, keep: Keep | None) -> Making:
    return Making(Plan(scenario, origin, checked=True), keep)


def _lost(plan: Plan, index: int, error: BaseException) -> Row:
    from biped.measure.metrics import NAMES

    run = plan.run(index)
    return {
        "index": index,
        "seed": run.seed,
        "values": run.values,
        "fell": False,
        "end": LOST,
        "cause": f"lost: {error}, and so was the next",
        **dict.fromkeys((name for name in NAMES if name != "falls"), math.nan),
        "walked": False,
        "stood": 0,
        "time": 0.0,
        "warnings": {},
    }
