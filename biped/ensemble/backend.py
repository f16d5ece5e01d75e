"""Who may carry items out for `biped.ensemble.executor`: this process, others, threads, a cluster."""

from __future__ import annotations

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


class Backend(Protocol):
    """Who carries items out.

    Attributes:
        room: Most items at a time.
    """

    room: int

    def send(self, ticket: int, item: Any) -> None:
        """Begins an item."""

    def receive(self) -> list[Done]:
        """Waits until at least one of the items begun is done."""
        ...

    def close(self, well: bool) -> None:
        """Lets everyone go; where not `well`, without waiting for what they are at."""
