"""Work as tasks of a Dask scheduler: a backend of the executor.

Few tasks are on their way at a time, so that the scheduler's memory does not grow. A task that costs workers is tried
again by Dask; what it gives up comes back as lost. A scheduler that is gone is waited for: then all that was on its way
is sent once more, since nobody else commits results.
"""

import queue
import time
import uuid
from collections.abc import Callable
from hashlib import blake2b
from typing import Any

from biped.base.errors import RunError
from biped.base.progress import Told
from biped.ensemble.backend import Done, WorkerLost
from biped.ensemble.cluster.connection import Connection
from biped.ensemble.cluster.worker import carry_out, described, platform, resources, versions, words

FLIGHT = 4
"""Tasks on their way for every worker."""
LOOK = 3.0
"""[s] between looks at who works."""
SOON = 10.0
"""[s] without a worker after which somebody is told."""


class Tasks:
    """A backend of tasks.

    Args:
        connection: To the scheduler.
        work: What they carry out; cloudpickle must be able to take it.
        same: Whether workers on another kind of machine are refused.
        tell: Told what a person should know.
    """

    lives = 1  # Dask has tried again

    def __init__(self, connection: Connection, work: Callable[[Any], Any], same: bool, tell: Told):
        import cloudpickle

        self._connection, self._tell = connection, tell
        self._packed = cloudpickle.dumps(work)
        self._key = blake2b(self._packed, digest_size=8).hexdigest()
        self._needs = resources(same)
        self._items: dict[int, Any] = {}
        self._futures: dict[int, Any] = {}
        self._ready: queue.SimpleQueue[tuple[int, Any]] = queue.SimpleQueue()
        self._workers, self._refused = 0, {}
        self._looked, self._seen, self._told_alone = 0.0, time.monotonic(), False
        self._look()

    @property
    def room(self) -> int:
        """See `biped.ensemble.backend.Backend`."""
        return FLIGHT * max(1, self._workers)

    @property
    def words(self) -> str:
        """Who works."""
        return f"{self._workers} worker{'' if self._workers == 1 else 's'}"

    def send(self, ticket: int, item: Any) -> None:
        """See `biped.ensemble.backend.Backend`."""
        self._items[ticket] = item
        self._submit(ticket)

    def _submit(self, ticket: int) -> None:
        future = self._connection.client.submit(
            carry_out, self._key, self._packed, self._items[ticket], pure=False, resources=self._needs,
            key=f"biped-{self._key}-{ticket}-{uuid.uuid4().hex[:12]}", workers=None,
        )  # fmt: skip
        self._futures[ticket] = future
        future.add_done_callback(lambda done: self._ready.put((ticket, done)))

    def receive(self) -> list[Done]:
        """See `biped.ensemble.backend.Backend`.

        Raises:
            RunError: Scheduler or workers are gone for too long.
        """
        while True:
            ready = []
            try:
                ready.append(self._ready.get(timeout=LOOK))
                while True:
                    ready.append(self._ready.get_nowait())
            except queue.Empty:
                pass
            done = [self._done(ticket, future) for ticket, future in ready if self._futures.get(ticket) is future]
            found = [one for one in done if one is not None]
            if len(found) < len(done):
                self._again()
            elif time.monotonic() - self._looked > LOOK:
                self._look()
            if found:
                self._seen = time.monotonic()
                return found

    def _done(self, ticket: int, future: Any) -> Done | None:
        """The outcome of a task; None if the scheduler that knew it is gone."""
        from distributed.scheduler import KilledWorker

        try:
            if future.status == "error":
                error = future.exception(timeout=60)
                lost = isinstance(error, KilledWorker)
                found = Done(ticket, error=WorkerLost(f"worker lost: {_last(error)}") if lost else error)
            elif future.status == "finished":
                found = Done(ticket, future.result(timeout=60))
            else:
                return None
        except Exception:  # what was finished cannot be had any more
            return None
        del self._futures[ticket], self._items[ticket]
        return found

    def _look(self) -> None:
        """Looks who works; says who is refused, and when nobody is there: our own workers are started anew."""
        self._looked = time.monotonic()
        there = self._connection.workers()
        if there is None:
            self._again()
            return
        good = {address for address, has in there.items() if self._needs.keys() <= has.keys()}
        self._workers = len(good)
        for address in there.keys() - good - self._refused.keys():
            self._refused[address] = self._refusal(address)
            self._tell(self._refused[address])
        if good:
            self._seen, self._told_alone = self._looked, False
            return
        if news := self._connection.mend():
            self._tell(news)
        alone = self._looked - self._seen
        wait, where = self._connection.wait, self._connection.place
        if wait is not None and alone > wait:
            refused = "".join(f"; {self._refused[address]}" for address in there if address in self._refused)
            raise RunError(
                f"{where}: no worker for {alone:.0f} s{refused}{self._connection.trouble()}; finished runs are kept: "
                "start workers, and the same command with --out goes on from there"
            )
        if alone > SOON and not self._told_alone:
            self._told_alone = True
            self._tell(f"{where}: no workers yet; {self._connection.remedy}")

    def _refusal(self, address: str) -> str:
        theirs = self._connection.call(described, address)
        if not isinstance(theirs, dict):
            return f"worker {address} is refused: expected one started by `biped worker` of the same version"
        for name, here in (("versions", versions()), ("platform", platform())):
            if theirs[name] != here:
                differ = [key for key in here if theirs[name].get(key) != here[key]]
                there, ours = (words({key: of.get(key, "none") for key in differ}) for of in (theirs[name], here))
                return f"worker {address} on {theirs['host']} is refused: it has {there}, here is {ours}"
        return f"worker {address} on {theirs['host']} is refused: expected one started by `biped worker`"

    def _again(self) -> None:
        """Finds the scheduler again, and sends what was on its way."""
        self._connection.again(self._tell)
        self._futures.clear()
        for ticket in list(self._items):
            self._submit(ticket)
        self._looked = self._seen = time.monotonic()

    def close(self, well: bool) -> None:
        """See `biped.ensemble.backend.Backend`; a task that nobody waits for any more is dropped."""
        futures, self._futures = self._futures, {}
        for future in futures.values():
            future.release()


def _last(error: Any) -> str:
    worker = getattr(error, "last_worker", None)
    return f"{getattr(error, 'allowed_failures', 0) + 1} workers ended with it, the last one {worker}"
