"""Which runs are called lost: Dask blames a worker's end on all that it had been given."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from distributed.scheduler import KilledWorker

from biped.ensemble.backend import WorkerLost
from biped.ensemble.cluster.tasks import Connection, Tasks
from biped.ensemble.cluster.worker import resources
from biped.ensemble.executor import Map


class Future:
    """Of a task that is over."""

    def __init__(self, error: Exception | None, value: Any):
        self.status, self._error, self._value = "error" if error else "finished", error, value

    def add_done_callback(self, call) -> None:
        call(self)

    def exception(self, timeout: float) -> Exception | None:
        return self._error

    def result(self, timeout: float) -> Any:
        return self._value

    def release(self) -> None:
        pass


class Client:
    """Ends `deadly` at every try, and its first companions with it."""

    def __init__(self, deadly: Any, companions: set[Any]):
        self.deadly, self.companions, self.sent = deadly, companions, []

    def submit(self, function, work, packed, item, **more) -> Future:
        first = item not in self.sent
        self.sent.append(item)
        killed = item == self.deadly or (first and item in self.companions)
        error = KilledWorker(item, SimpleNamespace(address="tcp://x:1"), 2) if killed else None
        return Future(error, f"done {item}")


def tasks_of(client: Client) -> Tasks:
    connection = Connection(lambda: client, "x", None, "")
    connection.workers = lambda: {"tcp://x:1": resources(False)}
    return Tasks(connection, str, False, print)


def test_only_a_run_that_ends_its_workers_by_itself_is_lost():
    client = Client(deadly=2, companions={1, 4})
    tasks = tasks_of(client)
    tasks._workers = 2  # so that all five are on their way at once
    found = list(Map(tasks)(range(5), lost=lambda item, error: error))
    assert [found[ticket] for ticket in (0, 1, 3, 4)] == ["done 0", "done 1", "done 3", "done 4"]
    assert isinstance(found[2], WorkerLost)
    assert "3 workers ended with it" in str(found[2])
    assert client.sent == [0, 1, 2, 3, 4, 1, 2, 4], "those that were blamed come again, one at a time"


def test_what_is_sent_while_one_is_judged_waits_for_it():
    client = Client(deadly=0, companions=set())
    tasks = tasks_of(client)
    tasks.send(0, 0)
    assert isinstance(tasks.receive()[0].error, WorkerLost)
    tasks.send(0, 0)
    tasks.send(1, 1)
    assert client.sent == [0, 0], "1 waits"
    assert [done.ticket for done in tasks.receive()] == [0]
    assert client.sent == [0, 0, 1]
    assert [done.value for done in tasks.receive()] == ["done 1"]
