"""Workers that are killed, whenever and however many, and what becomes of their items."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import textwrap
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from biped.ensemble import backend
from biped.ensemble.executor import STUCK, WorkerLost, workers

ROOT = Path(__file__).parents[2]

HERE = os.getpid()


def killed() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


class Pickling:
    """Kills whoever pickles it."""

    def __reduce__(self):
        killed()


def moment(name: str, marker: Path, monkeypatch):
    """A function of an item whose first worker is killed at that moment; the marker says that it was."""
    send, serve = Connection.send, backend._serve

    def first() -> bool:
        if os.getpid() == HERE or marker.exists():
            return False
        marker.touch()
        return True

    def dying_serve(*args):
        if first():
            killed()
        serve(*args)

    def dying_send(self, answer):
        if os.getpid() != HERE and answer == (25, None):
            if name == "before it answers" and first():
                killed()
            if name == "in the middle of its answer" and first():
                os.write(self.fileno(), struct.pack("!i", 1_000_000) + b"half")
                killed()
            send(self, answer)
            if name == "after its answer" and first():
                killed()
            return
        send(self, answer)

    def work(x: int):
        if x == 5:
            if name == "as it begins" and first():
                killed()
            if name == "in the middle of a file" and first():
                marker.with_name("half").write_bytes(b"half")
                killed()
            if name == "in compiled code" and first():
                import ctypes
                import faulthandler

                faulthandler.disable()  # it is meant; no page of where
                ctypes.string_at(0)
            if name == "by a thread of its own" and first():
                threading.Thread(target=killed).start()
                time.sleep(60)
            if name == "while it answers" and first():
                return Pickling()
            if name == "by ending itself" and first():
                os._exit(3)
        return x * x

    if name == "at its start":
        monkeypatch.setattr(backend, "_serve", dying_serve)
    monkeypatch.setattr(Connection, "send", dying_send)
    return work


MOMENTS = (
    "at its start", "as it begins", "in the middle of a file", "in compiled code", "by a thread of its own",
    "while it answers", "before it answers", "in the middle of its answer", "after its answer", "by ending itself",
)  # fmt: skip


@pytest.mark.parametrize("name", MOMENTS)
def test_a_worker_killed_at_any_moment_costs_nothing(name, tmp_path, monkeypatch):
    marker = tmp_path / "killed"
    with workers(moment(name, marker, monkeypatch), 2) as carried_out:
        assert list(carried_out(range(12))) == [x * x for x in range(12)]
        assert list(carried_out(range(12), ordered=False, lost=pytest.fail)), "and the others go on"
    assert marker.exists(), "nobody was killed"


def test_workers_killed_while_they_have_nothing_to_do():
    with workers(lambda _: os.getpid(), 2) as carried_out:
        first = set(carried_out(range(10)))
        for process in first:
            os.kill(process, signal.SIGKILL)
        second = list(carried_out(range(10)))
        assert len(second) == 10
        assert not first & set(second)


def test_an_item_that_kills_everyone_is_lost_and_the_others_are_not():
    def work(x: int) -> int:
        if x == 2:
            killed()
        return x

    def lost(x: int, error: BaseException) -> str:
        return f"{x}: {error}"

    with workers(work, 2) as carried_out:
        assert list(carried_out(range(5), lost=lost)) == [0, 1, "2: its process was killed (SIGKILL)", 3, 4]
    twice = r"cost two workers: its process was killed \(SIGKILL\)"
    with pytest.raises(WorkerLost, match=twice), workers(work, 2) as carried_out:
        list(carried_out(range(5)))


def test_an_item_is_done_once_more_and_not_oftener(tmp_path):
    def work(x: int) -> None:
        with open(tmp_path / str(x), "a", encoding="utf-8") as file:
            file.write("x")
        if x == 1:
            killed()

    with workers(work, 2) as carried_out:
        list(carried_out(range(4), lost=lambda *_: None))
    assert [(tmp_path / str(x)).read_text() for x in range(4)] == ["x", "xx", "x", "x"]


def test_where_every_worker_dies_there_is_an_end():
    with pytest.raises(WorkerLost, match=f"{STUCK} workers in a row"), workers(lambda _: killed(), 2) as carried_out:
        list(carried_out(range(1000), lost=lambda *_: None))


def test_no_worker_outlives_the_block():
    def alive(process: int) -> bool:
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return False
        return True

    with workers(lambda _: os.getpid(), 2) as carried_out:
        well = set(carried_out(range(10)))
    left = []
    with workers(lambda x: (os.getpid(), time.sleep(60 * x))[0], 2) as carried_out:
        left.append(next(carried_out(range(3), ordered=False)))  # and another one sleeps
    assert not any(alive(process) for process in (*well, *left))


PARENT = """
    import os, sys, time
    from biped.ensemble.executor import workers

    def work(x):
        print(os.getpid(), flush=True)
        while True: pass

    with workers(work, 3) as carried_out:
        list(carried_out(range(3)))
"""


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_workers_end_with_their_parent(how):
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(PARENT)], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    for _ in range(3):
        parent.stdout.readline()
    parent.send_signal(how)
    # The pipe ends when the last of those who could write to it is gone.
    out, err = parent.communicate(timeout=60)
    assert out == b""
    assert err.count(b"Traceback") == (1 if how == signal.SIGINT else 0), "a worker complained"


def test_ctrl_c_of_a_whole_terminal_is_the_parents_business():
    """The signal reaches workers too."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(PARENT)], env=environment, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    for _ in range(3):
        parent.stdout.readline()
    os.killpg(parent.pid, signal.SIGINT)
    _, err = parent.communicate(timeout=60)
    assert err.count(b"Traceback") == 1
