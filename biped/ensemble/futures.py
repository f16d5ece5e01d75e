"""Any executor of `concurrent.futures`' interface as a backend: threads of this process, or a cluster's executor."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from typing import Any

from biped.ensemble.backend import Done, WorkerLost


class Futures:
    """A backend on an executor.

    Args:
        executor: It; closed with the backend.
        work: The function; on other machines, pickle must be able to take it.
        room: Most items at a time.
    """

    lives = 2

    def __init__(self, executor: Executor, work: Callable[[Any], Any], room: int):
        self._executor = executor
        self._work = work
        self.room = room
        self._begun: dict[Future[Any], int] = {}

    def send(self, ticket: int, item: Any) -> None:
        """See `biped.ensemble.executor.Backend`."""
        self._begun[self._executor.submit(self._work, item)] = ticket

    def receive(self) -> list[Done]:
        """See `biped.ensemble.executor.Backend`."""
        return [self._done(future) for future in wait(self._begun, return_when=FIRST_COMPLETED).done]

    def _done(self, future: Future[Any]) -> Done:
        ticket, error = self._begun.pop(future), future.exception()
        if isinstance(error, BrokenExecutor):
            return Done(ticket, error=WorkerLost(f"a worker is gone: {error}"))
        return Done(ticket, error=error) if error is not None else Done(ticket, future.result())

    def close(self, well: bool) -> None:
        """See `biped.ensemble.executor.Backend`."""
        self._executor.shutdown(wait=True, cancel_futures=not well)
