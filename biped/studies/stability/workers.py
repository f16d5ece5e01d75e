"""A function of many items on all cores; the same answers for any number of jobs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from biped.ensemble.backend import Jobs, at_most
from biped.ensemble.executor import workers
from biped.ensemble.processes import FORKS


def mapped(function: Callable[[Any], Any], items: Sequence[Any], jobs: Jobs) -> list[Any]:
    """function(item) for every item, in their order.

    Args:
        function: Any function; forked workers share it and what it refers to. Where fork does not exist, one process
            does all.
        items: What it is called with.
        jobs: Number of processes, or a cluster.
    """
    elsewhere = not isinstance(jobs, int)
    with workers(function, at_most(jobs, len(items)) if FORKS or elsewhere else 1) as carried_out:
        return list(carried_out(items))
