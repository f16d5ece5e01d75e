"""Workers: every item is carried out, in order or as it is finished, in bounds, by whoever can."""

from __future__ import annotations

import time
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from itertools import count, islice
from pathlib import Path

import pytest

from biped.base.errors import InputError, RunError
from biped.ensemble import backend, executor
from biped.ensemble.backend import Futures
from biped.ensemble.executor import AHEAD, Map, workers


def square(x: int) -> int:
    return x * x


@contextmanager
def backends(kind: str, work):
    if kind == "here":
        with workers(work, 1) as carried_out:
            yield carried_out
    else:
        with workers(work, 3, threads=kind == "threads") as carried_out:
            yield carried_out


@pytest.mark.parametrize("kind", ["here", "processes", "threads"])
def test_results_come_in_order_or_as_they_are_finished(kind):
    with backends(kind, square) as carried_out:
        assert list(carried_out(range(20))) == [x * x for x in range(20)]
        assert sorted(carried_out(range(20), ordered=False)) == [x * x for x in range(20)]
        assert list(carried_out([])) == []


def test_order_does_not_wait_for_the_slowest_more_than_it_must():
    def work(x: int) -> int:
        time.sleep(0.3 if x == 0 else 0.0)
        return x

    with workers(work, 3) as carried_out:
        assert next(iter(carried_out(range(9), ordered=False))) != 0
    with workers(work, 3) as carried_out:
        assert list(carried_out(range(9))) == list(range(9))


@pytest.mark.parametrize("kind", ["here", "processes", "threads"])
def test_items_are_drawn_as_there_is_room(kind):
    drawn = []

    def items():
        for number in count():
            drawn.append(number)
            yield number

    with backends(kind, square) as carried_out:
        assert list(islice(carried_out(items()), 50)) == [x * x for x in range(50)]
    assert len(drawn) <= 50 + (AHEAD + 1) * 3


def test_a_slow_first_item_bounds_what_waits_behind_it():
    drawn = []

    def items():
        for number in range(200):
            drawn.append(number)
            yield number

    def work(x: int) -> int:
        time.sleep(0.5 if x == 0 else 0.0)
        return x

    with workers(work, 2) as carried_out:
        assert next(carried_out(items())) == 0
        assert len(drawn) <= 1 + (AHEAD + 1) * 2


@pytest.mark.parametrize("kind", ["here", "processes", "threads"])
def test_errors_come_across(kind):
    def work(x: int) -> int:
        if x == 3:
            raise InputError("law: what it was", "law")
        return x

    with pytest.raises(InputError, match="what it was") as caught, backends(kind, work) as carried_out:
        list(carried_out(range(9)))
    assert caught.value.key == "law"
    if kind == "processes":
        assert "in work" in caught.value.__notes__[0], "where it was raised there"


class Strange(Exception):
    """Can be pickled, but for good; it says how itself, or packages that pickle any error would find a way."""

    def __init__(self, one, two):
        super().__init__("only one")

    def __reduce__(self):
        return Strange, ("only one",)


@pytest.mark.parametrize("answer", ["lambda", "error of a lambda", "strange error"])
def test_answers_that_cannot_be_handed_over_are_errors(answer):
    def work(_):
        if answer == "lambda":
            return lambda: None
        raise ValueError(lambda: None) if answer == "error of a lambda" else Strange(1, 2)

    with pytest.raises(RunError, match=r"cannot be (handed over|read)"), workers(work, 2) as carried_out:
        list(carried_out(range(4)))


def test_where_no_process_can_be_started(monkeypatch):
    def refused(self):
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr("multiprocessing.context.ForkProcess.start", refused)
    says = "resource temporarily unavailable; try fewer --jobs"
    with pytest.raises(RunError, match=says), workers(square, 2) as carried_out:
        list(carried_out(range(3)))


class Elsewhere(Executor):
    """Stands for a cluster's executor: somebody else's, some of whose workers vanish."""

    def __init__(self):
        self.sent = 0
        self.closed = False

    def submit(self, fn, /, *args, **kwargs):
        self.sent += 1
        future: Future = Future()
        if self.sent % 5 == 0:
            future.set_exception(BrokenExecutor("node 7 is down"))
        else:
            future.set_result(fn(*args))
        return future

    def shutdown(self, wait=True, *, cancel_futures=False):
        self.closed = True


def test_any_executor_of_the_standard_interface_does():
    elsewhere = Elsewhere()
    backend = Futures(elsewhere, square, 4)
    assert list(Map(backend)(range(30))) == [x * x for x in range(30)]
    assert elsewhere.sent == 37
    backend.close(True)
    assert elsewhere.closed


def test_one_place_carries_things_out():
    """No other module of the package makes pools of processes or threads."""
    mine = {Path(executor.__file__), Path(backend.__file__), Path(executor.__file__).with_name("futures.py")}
    for path in Path(executor.__file__).parents[1].rglob("*.py"):
        if path not in mine:
            text = path.read_text(encoding="utf-8")
            assert "PoolExecutor" not in text, path
            assert ".Pool(" not in text, path
