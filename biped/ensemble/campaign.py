"""Many runs on all cores: the same numbers for any number of jobs, every finished run kept."""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from biped.base.errors import InputError
from biped.ensemble.backend import FORKS, Jobs, Told, at_most
from biped.ensemble.executor import workers
from biped.ensemble.midwalk import begun_walking
from biped.ensemble.plan import Plan
from biped.ensemble.rows import FLAGS, LOST, Row
from biped.measure.metrics import assess
from biped.measure.trajectory import Trajectory
from biped.robot.robot import seven_links
from biped.robot.run import Run
from biped.scenario.engines import ENGINES
from biped.scenario.keys import Scenario

Keep = Callable[[int, "Trajectory", Row], None]
"""Called where a run was made with (index, trajectory, row), for what must be kept of it."""


def simulate_planar(run: Run) -> Trajectory:
    """Simulates a run of a planar biped of seven links.

    Raises:
        InputError: It is one of a robot of another kind.
    """
    seven_links(run.robot)
    return simulate(run)


def simulate(run: Run) -> Trajectory:
    """Simulates a run in the engine that its scenario names, from the middle of a walk if it asks for that."""
    with run.origin.naming():
        if run.scenario.start.walking:
            run = begun_walking(run, _engine(run.scenario).simulate)
        return _engine(run.scenario).simulate(run)


def _engine(scenario: Scenario) -> ModuleType:
    """The engine that a scenario names."""
    return import_module(ENGINES[scenario.engine].place)


def measured(run: Run) -> tuple[Trajectory, dict[str, Any]]:
    """Simulates, judges and measures a run."""
    return assess(simulate(run), run.scenario.interval)


def run_one(plan: Plan, index: int) -> tuple[Trajectory, Row]:
    """Simulates, judges and measures run `index` of a plan."""
    run = plan.run(index)
    with np.errstate(all="ignore"):  # what blows up overflows, and is called so
        trajectory, numbers = assess(simulate(run), run.scenario.interval)
    told = {name: bool(numbers.pop(name)) for name in FLAGS}
    row = Row(
        index=index,
        seed=run.seed,
        values=run.values,
        fell=bool(numbers.pop("falls")),
        end=trajectory.end,
        cause=trajectory.cause,
        warnings=trajectory.warnings,
        **told,
        **numbers,
    )
    return trajectory, row


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def rows_of(plan: Plan, indices: Iterable[int], jobs: Jobs, keep: Keep | None = None) -> Iterator[Iterator[Row]]:
    """Rows of the given runs, as they are finished.

    Args:
        plan: The ensemble.
        indices: Which runs.
        jobs: Number of processes, 1 of which stays in this one; or a cluster.
        keep: What must be kept of a run, where it was made.

    Yields:
        An iterator over rows, in any order.
    """
    indices = list(indices)
    jobs = at_most(jobs, len(indices))
    if isinstance(jobs, int) and jobs > 1:
        # Forked workers share what is imported here: whoever takes a killed one's place is at work at once.
        from biped.measure import metrics  # noqa: F401

        _engine(plan.scenario)
    with workers(Making(plan, keep), jobs, isinstance(jobs, int) and side_by_side(plan)) as carried_out:
        yield carried_out(indices, ordered=False, lost=partial(lost_row, plan))


@contextmanager
def workers_at(jobs: int | None, cluster: str | None, same: bool, tell: Told) -> Iterator[Jobs]:
    """Who carries out: so many processes, or a cluster, which is let go when the block ends.

    Args:
        jobs: Number of processes; default: all cores.
        cluster: Workers elsewhere instead; see `biped.ensemble.cluster.cluster_at`.
        same: Whether workers on another kind of machine are refused.
        tell: Told what a person should know of a cluster.

    Raises:
        InputError: There is no such cluster, or both are named.
    """
    if cluster is None:
        yield cores() if jobs is None else jobs
        return
    if jobs is not None:
        raise InputError("jobs: expected without cluster, which has workers of its own")
    from biped.ensemble.cluster import cluster_at

    with cluster_at(cluster, same, tell) as workers:
        yield workers


def side_by_side(plan: Plan) -> bool:
    """Whether runs are made by threads: where processes do not fork and would import and compile all anew.

    Compiled loops hold no interpreter lock, so threads are as fast as processes; but a fault of compiled code ends them
    all, where forked workers lose one run. Laws in Python need processes in any case.
    """
    if FORKS:
        return False
    from biped.control.planar.controller import python_needed
    from biped.engines.loop import by_kind

    return by_kind(plan.run(0), lambda run: not python_needed(run, run.tree), lambda _: False)


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


def lost_row(plan: Plan, index: int, error: BaseException) -> Row:
    """The row of a run that cost too many workers."""
    run = plan.run(index)
    cause = f"lost: {error}, and so was the next"
    return Row(
        index=index,
        seed=run.seed,
        values=run.values,
        fell=False,
        end=LOST,
        cause=cause,
        walked=False,
        stood=0,
        time=0.0,
    )
