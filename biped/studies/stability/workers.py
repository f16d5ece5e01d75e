"""A function of many items on all cores; the same answers for any number of jobs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from biped.ensemble.processes import FORKS, pool

_function: Callable[[Any], Any] | None = None


def mapped(function: Callable[[Any], Any], items: Sequence[Any], jobs: int) -> list[Any]:
    """function(item) for every item, in their order.

    Args:
        function: Any function; forked workers share it and what it refers to. Where fork does not exist, one process
            does all.
        items: What it is called with.
        jobs: Number of processes.
    """
    if jobs <= 1 or len(items) < 2 or not FORKS:
        return [function(item) for item in items]
    with pool(min(jobs, len(items)), _begin, (function,)) as workers:
        return workers.map(_call, items, chunksize=1)


def _begin(function: Callable[[Any], Any]) -> None:
    global _function
    _function = function


def _call(item: Any) -> Any:
    assert _function is not None
    return _function(item)
