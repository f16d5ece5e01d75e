"""Who may carry items out for `biped.ensemble.executor`: this process, others, threads, a cluster."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from biped.base.errors import RunError


class WorkerLost(RunError):
    """Whoever carried an item out is gone: says how."""


class Done(NamedTuple):
    """What became of an item.

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
