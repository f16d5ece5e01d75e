"""A function of many items on all cores; the same answers for any number of jobs."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Sequence
from typing import Any

_function: Callable[[Any], Any] | None = None


def mapped(function: Callable[[Any], Any], items: Sequence[Any], jobs: int) -> list[Any]:
    """function(item) for every item, in their order.

    Args:
        function: Any function; forked workers share it and what it refers to. Where fork does not exist, one process
            does all.
        items: What it is called with.
        jobs: Number of processes.
    """
    if jobs <= 1 or len(items) < 2 or "fork" not in multiprocessing.get_all_start_methods():
        return [function(item) for item in items]
    global _function
    _function = function
    with multiprocessing.get_context("fork").Pool(min(jobs, len(items)), _begin) as pool:
        answers = pool.map(_call, items, chunksize=1)
        pool.close()  # whoever is done ends by itself, properly
        pool.join()
    return answers


def _begin() -> None:
    # Ctrl-C is the parent's business: it ends the pool.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _call(item: Any) -> Any:
    assert _function is not None
    return _function(item)
