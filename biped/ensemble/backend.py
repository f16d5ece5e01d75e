"""Who may carry items out for `biped.ensemble.executor`: this process, others, threads, a cluster; and their progress.

Processes work for this one, and never longer than it. Each has a pipe of its own, whose other end closes with it
however it ends, even in the middle of an answer: so it is known who is gone, and with which item. (The pools of the
standard library lose the item, or all of them.)
"""

import ctypes
import multiprocessing
import multiprocessing.process
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import AbstractContextManager, contextmanager, suppress
from multiprocessing import connection
from multiprocessing.connection import Connection
from typing import Any, NamedTuple, Protocol

from biped.base.errors import RunError
from biped.base.writing import reason


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


FORKS = "fork" in multiprocessing.get_all_start_methods()
"""Whether workers share what is already imported and compiled; otherwise they start afresh."""

PATIENCE = 1.0
"""[s] after which it is looked whether workers are alive: a child of theirs may hold their pipe open."""
FAREWELL = 10.0
"""[s] that a worker is given to end by itself."""


class Processes:
    """A backend of processes, which start as there is something to do.

    Args:
        work: The function; forked workers share it and what it refers to.
        jobs: Number of processes.
    """

    lives = 2

    def __init__(self, work: Callable[[Any], Any], jobs: int):
        self.room = jobs
        self._work = work
        self._context: Any = multiprocessing.get_context("fork" if FORKS else "spawn")
        self._everyone: dict[Connection, Any] = {}  # processes by their pipe
        self._idle: list[Connection] = []
        self._busy: dict[Connection, int] = {}  # tickets

    def send(self, ticket: int, item: Any) -> None:
        """See `biped.ensemble.executor.Backend`."""
        while True:
            fresh = not self._idle
            if fresh:
                self._start()
            pipe = self._idle.pop()
            try:
                pipe.send(item)
            except OSError:
                if not fresh:  # killed while it had nothing to do
                    self._bury(pipe)
                    continue
            self._busy[pipe] = ticket  # that a worker dies of its start is found by `receive`
            return

    def receive(self) -> list[Done]:
        """See `biped.ensemble.executor.Backend`."""
        while True:
            ready = connection.wait(list(self._busy), PATIENCE)
            done = ready or [pipe for pipe in self._busy if not self._everyone[pipe].is_alive()]
            if done:
                return [self._answer(pipe) for pipe in done]  # pyright: ignore[reportArgumentType]

    def _answer(self, pipe: Connection) -> Done:
        ticket = self._busy.pop(pipe)
        try:
            if not pipe.poll():
                raise EOFError
            value, error = pipe.recv()
        except (EOFError, OSError):
            return Done(ticket, error=WorkerLost(self._bury(pipe)))
        except Exception as what:  # errors of strange classes: pickled, but for good
            value, error = None, RunError(f"a worker's answer cannot be read: {what}")
        self._idle.append(pipe)
        return Done(ticket, value, error)

    def _start(self) -> None:
        ours, theirs = self._context.Pipe()
        inherited = [ours, *self._everyone] if FORKS else []
        # No daemon: what it carries out may start processes of its own.
        process = self._context.Process(target=_serve, args=(theirs, self._work, inherited))
        with _undisturbed():
            try:
                process.start()
            except OSError as error:
                raise RunError(f"no process can be started: {reason(error)}; try fewer --jobs") from error
            theirs.close()
            self._everyone[ours] = process
            self._idle.append(ours)

    def _bury(self, pipe: Connection) -> str:
        """Ends a worker that is of no use any more; says how it ended."""
        process = self._everyone.pop(pipe)
        pipe.close()
        process.join(PATIENCE)
        process.kill()
        process.join()
        code = process.exitcode
        process.close()
        if code is not None and code < 0:
            return f"its process was killed ({signal.Signals(-code).name})"
        return f"its process ended itself (exit code {code})"

    def close(self, well: bool) -> None:
        """See `biped.ensemble.executor.Backend`."""
        with _undisturbed():
            for pipe, process in self._everyone.items():
                if not well or pipe in self._busy:
                    process.kill()
                    continue
                with suppress(OSError):
                    pipe.send(_Stop)
            for pipe, process in list(self._everyone.items()):
                process.join(FAREWELL)
                self._bury(pipe)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Lets Ctrl-C wait, so that no process is started or ended by half."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Stop:
    """Sent to a worker that may go."""


def _serve(pipe: Connection, work: Callable[[Any], Any], inherited: list[Connection]) -> None:
    """The loop of a worker: it answers items until it is stopped or the parent is gone."""
    # Ctrl-C is the parent's business: it ends its workers and keeps what is finished. A parent that was killed cannot:
    # then its workers end themselves. (Until here the signal was held back: see `_undisturbed`.)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    for other in inherited:
        other.close()
    _die_with_parent()
    threading.Thread(target=_end_with, args=(multiprocessing.parent_process(),), daemon=True).start()
    while True:
        try:
            item = pipe.recv()
        except (EOFError, OSError):  # the parent is gone
            return
        if item is _Stop:
            return
        try:
            answer = work(item), None
        except Exception as error:
            error.add_note("".join(traceback.format_exception(error)))
            answer = None, error
        try:
            pipe.send(answer)
        except OSError:
            return
        except Exception as error:  # what cannot be pickled cannot be handed over
            pipe.send((None, RunError(f"{answer[1] or type(answer[0]).__name__}: cannot be handed over: {error}")))


def _die_with_parent() -> None:
    """Has Linux end this process at once when its parent is killed: a thread waits until a kernel lets it run."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PDEATHSIG, signal.SIGKILL)


_PDEATHSIG = 1


def _end_with(parent: multiprocessing.process.BaseProcess) -> None:
    parent.join()
    os._exit(1)


Progress = Callable[[str, int, int], AbstractContextManager[Callable[..., None]]]
"""Called with a title, how many pieces of work there are and how many are done; gives what is called when pieces are
finished: without arguments for one, else with how many they are and words on who works."""

Told = Callable[[str], None]
"""Called with what a person should know although nothing failed."""


@contextmanager
def silent(title: str, total: int, done: int) -> Iterator[Callable[..., None]]:
    """Progress that nobody watches."""
    yield lambda *_: None


def unheard(words: str) -> None:
    """Drops words that nobody listens to."""
