"""Who may carry items out for `biped.ensemble.executor`: this process, others, threads, a cluster."""

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from typing import Any, NamedTuple, Protocol

from biped.base.errors import RunError


class WorkerLost(RunError):
    """Whoever carried an item out is gone: says how."""


class Done(NamedTuple):
    """The outcome of an item of work.

    Attributes:
        ticket: Its number.
        value: What came of it.
        error: What was raised instead; a `WorkerLost` if nobody knows.
    """

    ticket: int
    value: Any = None
    error: BaseException | None = None


WAIT: Any = object()
"""Stands for an item where there is none yet, but may be after the next result."""


class Backend(Protocol):
    """Who carries items out.

    Attributes:
        lives: How many workers an item may cost.
    """

    lives: int

    @property
    def room(self) -> int:
        """Most items at a time, for now."""
        ...

    def send(self, ticket: int, item: Any) -> None:
        """Begins an item."""

    def receive(self) -> list[Done]:
        """Waits until at least one of the items begun is done."""
        ...

    def close(self, well: bool) -> None:
        """Lets everyone go; where not `well`, without waiting for what they are at."""


class Cluster(Protocol):
    """Workers elsewhere."""

    def backend(self, work: Callable[[Any], Any]) -> Backend:
        """They carry `work` out, which is sent to them."""
        ...


Jobs = int | Cluster
"""Who carries out: so many processes here, or a cluster."""


def at_most(jobs: Jobs, items: int) -> Jobs:
    """No more processes than items."""
    return min(jobs, items) if isinstance(jobs, int) else jobs


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
