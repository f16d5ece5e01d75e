"""One way to carry out many items on many cores: `workers` opens them, the `Map` it gives does the rest.

A worker that is killed (by hand, by the out-of-memory killer, by a fault of compiled code) costs the item that it had:
that is done once more, at once and by another worker; killed again, it is lost, and whoever asked says what stands in
its place. Whatever happens, a map ends.

Who carries items out is a `Backend`: this process, its children, or any executor of `concurrent.futures`' interface:
threads here, a cluster's elsewhere. Its workers share nothing but the function and their items.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Generic, TypeVar

from biped.ensemble.backend import WAIT, Backend, Done, Futures, Jobs, Processes, WorkerLost, at_most

Item = TypeVar("Item")
Result = TypeVar("Result")

AHEAD = 4
"""Items per worker that may be finished before an earlier one that is still waited for."""
STUCK = 20
"""Workers lost in a row, without a single item done, that are no accident any more."""

_END: Any = object()


class Map(Generic[Item, Result]):
    """The function's results for many items.

    Args:
        backend: Who carries them out.
    """

    def __init__(self, backend: Backend):
        self._backend = backend

    @property
    def room(self) -> int:
        """Most items at a time, for now."""
        return self._backend.room

    @property
    def words(self) -> str:
        """Who works, for people; nothing of processes here."""
        return getattr(self._backend, "words", "")

    def __call__(
        self, items: Iterable[Item], ordered: bool = True, lost: Callable[[Item, BaseException], Result] | None = None
    ) -> Iterator[Result]:
        """Yields results as they come; items are drawn as there is room for them, so they may be endless.

        Args:
            items: What the function is called with; `WAIT` where there is none before the next result.
            ordered: Whether results come in the order of items; otherwise as they are finished.
            lost: The result of an item that cost too many workers; without it, the map ends with the error.

        Raises:
            WorkerLost: An item cost too many workers, or workers are lost one after the other.
            BaseException: What the function raised.
        """
        source = iter(items)
        begun: dict[int, Item] = {}
        early: dict[int, Result] = {}
        lives = _Lives(self._backend)
        drawn, following, more = 0, 0, True
        while True:
            room = self._backend.room
            while more and len(begun) < room and len(early) < AHEAD * room:
                item = next(source, _END)
                more = item is not _END
                if item is _END or item is WAIT:
                    break
                begun[drawn] = item
                self._backend.send(drawn, item)
                drawn += 1
            if not begun:
                return
            for done in self._backend.receive():
                item = begun[done.ticket]
                if lives.again(done, lost is not None):
                    self._backend.send(done.ticket, item)
                    continue
                del begun[done.ticket]
                result = done.value if done.error is None or lost is None else lost(item, done.error)
                if not ordered:
                    yield result
                    continue
                early[done.ticket] = result
                while following in early:
                    yield early.pop(following)
                    following += 1


class _Lives:
    """How often workers were lost."""

    def __init__(self, backend: Backend):
        self._backend = backend
        self._lost: Counter[int] = Counter()
        self._in_a_row = 0

    def again(self, done: Done, bearable: bool) -> bool:
        """Whether an item is to be done once more; raises what cannot be borne."""
        if done.error is None:
            self._in_a_row = 0
            return False
        if not isinstance(done.error, WorkerLost):
            raise done.error
        self._in_a_row += 1
        if self._in_a_row >= max(STUCK, 4 * self._backend.room):
            raise WorkerLost(f"{self._in_a_row} workers in a row were lost: {done.error}; try fewer --jobs")
        self._lost[done.ticket] += 1
        if self._lost[done.ticket] < self._backend.lives:
            return True
        if not bearable:
            raise WorkerLost(f"one piece of work cost two workers: {done.error}") from done.error
        del self._lost[done.ticket]
        return False


class Here:
    """This process, one item after the other.

    Args:
        work: The function.
    """

    room, lives = 1, 1

    def __init__(self, work: Callable[[Any], Any]):
        self._work = work
        self._begun: list[tuple[int, Any]] = []

    def send(self, ticket: int, item: Any) -> None:
        """See `Backend`."""
        self._begun.append((ticket, item))

    def receive(self) -> list[Done]:
        """See `Backend`; errors are raised where they happen."""
        ticket, item = self._begun.pop()
        return [Done(ticket, self._work(item))]

    def close(self, well: bool) -> None:
        """See `Backend`."""


@contextmanager
def workers(work: Callable[[Item], Result], jobs: Jobs, threads: bool = False) -> Iterator[Map[Item, Result]]:
    """Opens workers, who are gone when the block ends, however it ends.

    Args:
        work: The function. Where processes fork, it may be anything, and what it refers to is shared; otherwise it
            must be what pickle can take.
        jobs: Number of workers, one of which works in this process; or a cluster, to which the function is sent.
        threads: Whether they are threads of this process, for work that leaves the interpreter alone.

    Yields:
        A map that may be used many times, one at a time.
    """
    backend: Backend
    if not isinstance(jobs, int):
        backend = jobs.backend(work)
    elif jobs <= 1:
        backend = Here(work)
    elif threads:
        from concurrent.futures import ThreadPoolExecutor

        backend = Futures(ThreadPoolExecutor(jobs), work, jobs)
    else:
        backend = Processes(work, jobs)
    well = False
    try:
        yield Map(backend)
        well = True
    finally:
        backend.close(well)


def mapped(function: Callable[[Any], Any], items: Sequence[Any], jobs: Jobs) -> list[Any]:
    """Calls a function with many items on all cores: function(item) of every item, in their order.

    Args:
        function: Any function; forked workers share it and what it refers to. Where fork does not exist, one process
            does all.
        items: What it is called with.
        jobs: Number of processes, or a cluster.
    """
    from biped.ensemble.backend import FORKS

    elsewhere = not isinstance(jobs, int)
    with workers(function, at_most(jobs, len(items)) if FORKS or elsewhere else 1) as carried_out:
        return list(carried_out(items))
