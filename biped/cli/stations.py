"""Scenarios side by side in processes of their own, with a line for each that is done.

Whoever runs biped for the first time waits for its kernels to be compiled. A lane is a list of scenarios that need the
same kernels: they run one after another, so that no kernel is compiled twice, and lanes run beside each other.
"""

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from biped.base.kernels import cache_folder
from biped.base.objects import shipped_folder
from biped.ensemble.executor import workers

_SECONDS = 1.0
"""[s] between two states of the line that says how long it has been."""


class Station(NamedTuple):
    """A scenario that was run.

    Attributes:
        scenario: Its name.
        folder: Its results.
        code: The exit code of `biped run`.
        seconds: [s] that it took, compiling included.
        error: What the process wrote to stderr.
    """

    scenario: str
    folder: Path
    code: int
    seconds: float
    error: str


def is_compiled() -> bool:
    """Whether this installation has compiled kernels, of its own or shipped with it."""
    return any(any(folder.glob("*.o")) for folder in (cache_folder() / "objects", shipped_folder()))


def visit(
    lanes: Sequence[Sequence[str]], folder: Path, options: Sequence[str], done: Callable[[Station], None]
) -> list[Station]:
    """Runs scenarios and returns them in the order of the lanes.

    Args:
        lanes: Names of scenarios; those of one lane run one after another.
        folder: Each leaves its results in a folder below.
        options: Of `biped run`.
        done: Called with each that is done.
    """

    def lane(names: Sequence[str]) -> list[Station]:
        found = []
        for name in names:
            begun, out = perf_counter(), folder / name.replace("/", "-")
            argv = [sys.executable, "-m", "biped", "run", name, "--out", str(out), "--jobs", "1", *options]
            ended = subprocess.run(argv, capture_output=True, text=True, check=False)
            found.append(Station(name, out, ended.returncode, perf_counter() - begun, ended.stderr))
            done(found[-1])
        return found

    with workers(lane, len(lanes), threads=True) as each:
        return [station for found in each(lanes) for station in found]


@contextmanager
def clock(words: str) -> Iterator[None]:
    """A line on the terminal that says what is waited for and how long it has been; nothing without a terminal."""
    if not sys.stderr.isatty():
        yield
        return
    over, begun = threading.Event(), perf_counter()

    def tick() -> None:
        while not over.wait(_SECONDS):
            print(f"\r  {words}: {perf_counter() - begun:.0f} s ", end="", file=sys.stderr, flush=True)

    teller = threading.Thread(target=tick, daemon=True)
    teller.start()
    try:
        yield
    finally:
        over.set()
        teller.join()
        print(f"\r{' ' * (len(words) + 12)}\r", end="", file=sys.stderr, flush=True)
