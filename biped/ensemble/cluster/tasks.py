"""Work as tasks of a Dask scheduler, a backend of the executor; its connection may be lost and found again.

Few tasks are on their way at a time, so that the scheduler's memory does not grow. A task that costs workers is tried
again by Dask; what it gives up comes back as lost, and the executor sends it once more. A scheduler that is gone is
waited for: then all that was on its way is sent once more, since nobody else commits results.
"""

import logging
import queue
import time
import uuid
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from hashlib import blake2b
from typing import Any

from biped.base.errors import InputError, RunError, why
from biped.ensemble.backend import Done, Told, WorkerLost
from biped.ensemble.cluster.worker import carry_out, described, platform, resources, versions, words

ANSWER = 30.0
"""[s] within which a scheduler answers."""
CONNECT = 10.0
"""[s] that a try to reach it takes."""


class Connection:
    """A connection.

    Args:
        connect: Reaches the scheduler, started anew if that is our business; raises OSError.
        place: What it is called.
        wait: [s] that a scheduler, or a first worker, is waited for; None: for ever.
        remedy: What to do where there are no workers.
        trouble: What is known of workers that do not come.
        mend: Starts workers anew that ended, if that is our business, and says so in words; raises RunError.

    Attributes:
        client: Dask's client.

    Raises:
        InputError: There is no scheduler.
    """

    def __init__(
        self, connect: Callable[[], Any], place: str, wait: float | None, remedy: str,
        trouble: Callable[[], str] = str, mend: Callable[[], str] = str,
    ):  # fmt: skip
        self._connect, self.place, self.wait, self.remedy, self.trouble = connect, place, wait, remedy, trouble
        self.mend = mend
        _hush()
        try:
            self.client = connect()
        except OSError as error:
            raise InputError(f"--cluster {place}: expected a running Dask scheduler: {why(error)}") from None

    def _call(self, call: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
        return self.client.sync(call, *arguments, callback_timeout=ANSWER, **more)

    def workers(self) -> dict[str, dict[str, float]] | None:
        """Resources of every worker by its address; None if the scheduler does not answer."""
        try:
            if self.client.status != "running":
                return None
            found = self._call(self.client.scheduler.identity)["workers"]
        except Exception:  # whatever a broken connection raises
            return None
        return {address: dict(worker["resources"]) for address, worker in found.items()}

    def call(self, function: Callable[[], Any], address: str) -> Any:
        """A worker's answer to a call; an error if it cannot."""
        try:
            return self._call(self.client._run, function, workers=[address], on_error="return")[address]
        except Exception as error:
            return error

    def dashboard(self) -> str:
        """Address of Dask's own page on the cluster, if it has one."""
        try:
            services = self._call(self.client.scheduler.identity)["services"]
            return self.client.dashboard_link if "dashboard" in services else ""
        except Exception:
            return ""

    def again(self, tell: Told) -> None:
        """Finds the scheduler again.

        Raises:
            RunError: It stays away.
        """
        self.close()
        tell(f"{self.place}: the scheduler is gone or does not answer; it is waited for, and finished runs are kept")
        began = time.monotonic()
        while True:
            try:
                self.client = self._connect()
                return
            except OSError:
                if self.wait is not None and time.monotonic() - began > self.wait:
                    break
                time.sleep(1.0)
        raise RunError(
            f"{self.place}: no scheduler for {self.wait:.0f} s; finished runs are kept: start it and its workers, and "
            "the same command with --out goes on from there"
        )

    def close(self) -> None:
        """Lets the scheduler go."""
        with suppress(Exception):
            self.client.close(timeout=2)


def _hush() -> None:
    """Silences the logs of Dask and of what it rests on, also where Dask has set their levels: what matters is said."""
    import distributed  # noqa: F401

    for name in {"distributed", "asyncio", "tornado", *logging.root.manager.loggerDict}:
        if name.partition(".")[0] in ("distributed", "asyncio", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)


def connecting(address: str, tls: Mapping[str, str]) -> Callable[[], Any]:
    """Returns a function that connects to a scheduler at an address.

    Args:
        address: Its address.
        tls: Files `ca_file`, `cert` and `key`; without any, Dask's own configuration says them.
    """

    def connect() -> Any:
        from distributed import Client, Security

        names = {"ca_file": "tls_ca_file", "cert": "tls_client_cert", "key": "tls_client_key"}
        files = {names[name]: path for name, path in tls.items()}
        security = Security(require_encryption=True, **files) if files else None
        return Client(address, timeout=CONNECT, security=security, set_as_default=False)

    return connect


FLIGHT = 4
"""Tasks on their way for every worker."""
LOOK = 3.0
"""[s] between looks at who works."""
SOON = 10.0
"""[s] without a worker after which somebody is told."""


class Tasks:
    """A backend of tasks.

    Dask blames a worker's end on all tasks that it had been given. What it gives up is lost, and if that is sent once
    more, it goes when no other task is on its way: whoever ends workers then does so by itself.

    Args:
        connection: To the scheduler.
        work: What they carry out; cloudpickle must be able to take it.
        same: Whether workers on another kind of machine are refused.
        tell: Told what a person should know.
    """

    lives = 2  # of which Dask takes each to several workers

    def __init__(self, connection: Connection, work: Callable[[Any], Any], same: bool, tell: Told):
        import cloudpickle

        self._connection, self._tell = connection, tell
        self._packed = cloudpickle.dumps(work)
        self._key = blake2b(self._packed, digest_size=8).hexdigest()
        self._needs = resources(same)
        self._items: dict[int, Any] = {}
        self._futures: dict[int, Any] = {}
        self._ready: queue.SimpleQueue[tuple[int, Any]] = queue.SimpleQueue()
        self._waiting: deque[int] = deque()
        self._blamed: set[int] = set()  # of tickets that were lost once
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
        self._waiting.append(ticket)
        self._begin()

    def _begin(self) -> None:
        """Submits what waits, in turn; one that was blamed goes alone."""
        while self._waiting:
            alone = self._waiting[0] in self._blamed or not self._blamed.isdisjoint(self._futures)
            if alone and self._futures:
                return
            self._submit(self._waiting.popleft())

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
            self._begin()
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
        self._blamed.discard(ticket)
        if isinstance(found.error, WorkerLost):
            self._blamed.add(ticket)
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
        self._waiting = deque(self._items)
        self._begin()
        self._looked = self._seen = time.monotonic()

    def close(self, well: bool) -> None:
        """See `biped.ensemble.backend.Backend`; a task that nobody waits for any more is dropped."""
        futures, self._futures = self._futures, {}
        for future in futures.values():
            future.release()


def _last(error: Any) -> str:
    worker = getattr(error, "last_worker", None)
    return f"{getattr(error, 'allowed_failures', 0) + 1} workers ended with it, the last one {worker}"
