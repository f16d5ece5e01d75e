"""Processes that work for this one, and never longer than it."""

from __future__ import annotations

import multiprocessing
import multiprocessing.process
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.pool import Pool
from typing import Any

FORKS = "fork" in multiprocessing.get_all_start_methods()
"""Whether workers share what is already imported and compiled; otherwise they start afresh."""


@contextmanager
def pool(jobs: int, begin: Callable[..., None] | None = None, arguments: tuple[Any, ...] = ()) -> Iterator[Pool]:
    """A pool of processes, which are gone when the block ends, however it ends.

    Args:
        jobs: Number of processes.
        begin: Called first in each of them.
        arguments: What it is called with; where processes fork, it may be anything.
    """
    workers = multiprocessing.get_context("fork" if FORKS else "spawn").Pool(jobs, _begin, (begin, arguments))
    try:
        yield workers
        workers.close()  # whoever is done ends by itself, properly
        workers.join()
    finally:
        workers.terminate()
        workers.join()


def _begin(begin: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    # Ctrl-C is the parent's business: it ends the pool and keeps what is finished. A parent that was killed
    # cannot: then its workers end themselves.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(multiprocessing.parent_process(),), daemon=True).start()
    if begin is not None:
        begin(*arguments)


def _end_with(parent: multiprocessing.process.BaseProcess) -> None:
    parent.join()
    os._exit(1)
