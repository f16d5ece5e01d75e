"""`biped demo`: pushes, a slope and other robots in a minute, with a page of what happened.

Whoever runs biped for the first time waits for its kernels to be compiled. A lane is a list of scenarios that need the
same kernels: they run one after another, so that no kernel is compiled twice, and lanes run beside each other.
"""

import argparse
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from biped.cli import common

PUSH = (("demo/push",), ("demo/home",))
TOUR = (("demo/push", "demo/slope", "demo/robot"), ("demo/h1",))
SPACE = (("demo/push",), ("demo/home",), ("demo/h1", "demo/space"))
"""Lanes of scenarios (`biped.cli.commands.demo`): all kernels that shipped scenarios need are those of the last."""
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


def add_demo(commands: common.Commands) -> None:
    """Adds the parser of `biped demo`."""
    parser = common.command_parser(
        commands, "demo", "show a minute of pushes, a slope and other robots, and write a page", demo_command,
        description="Runs four scenarios beside each other and writes a page: a human that walks and is pushed, the "
        "same on a slope, the robot of the thesis and Unitree's H1.",
    )  # fmt: skip
    parser.add_argument("--push", action="store_true", help="run only the push, in both engines, with a recording")
    parser.add_argument("--compile", action="store_true", help="only compile what runs need")
    parser.add_argument("--out", type=Path, help="folder for results and page (default: a new one below runs/)")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")


def demo_command(args: argparse.Namespace) -> int:
    """Runs the scenarios, shows what became of them, and prints the path of the page and what to type next."""
    from tempfile import TemporaryDirectory

    if args.compile:
        with TemporaryDirectory(prefix="biped-") as folder:
            return _visit(SPACE, Path(folder), ["--set", "duration=1", "--set", "push=[]", "--set", "expect={}"])[0]
    out = common.folder_of(args, "demo")
    code, stations = _visit(PUSH if args.push else TOUR, out, ["--record"] if args.push else [])
    page = out / "demo.html"
    _write(stations, page)
    if args.open:
        import webbrowser

        webbrowser.open(page.resolve().as_uri())
    _next(stations, page)
    return code


def _visit(lanes: tuple[tuple[str, ...], ...], out: Path, options: list[str]) -> tuple[int, list[Station]]:
    """The exit code of all scenarios, and what became of each."""
    words = "running"
    if not is_compiled():
        words = "compiling for this processor"
        print("This installation runs for the first time: it compiles for this processor, which takes about a minute.\n"
              "Meanwhile you can choose a page for what you want to do: docs/index.md", flush=True)  # fmt: skip
    with clock(words):
        stations = visit(
            lanes, out, options, lambda one: print(f"  {one.scenario:<12} {one.seconds:5.1f} s", flush=True)
        )
    for station in stations:
        if station.code not in (common.DONE, common.FAILED) or not (station.folder / "result.json").is_file():
            print(station.error.strip())
    return max(station.code for station in stations), stations


def _write(stations: list[Station], page: Path) -> None:
    """A table of verdicts on the terminal, and the page."""
    from biped.ensemble.checks import judgement
    from biped.show.document import Table
    from biped.show.page import write_page
    from biped.studies.folders import results_at

    rows = []
    whole = [station.folder for station in stations if (station.folder / "result.json").is_file()]
    for folder in whole:
        result = results_at(folder)
        speed, force = (result["summary"][name] for name in ("speed", "peak_force"))
        rows.append((result["scenario"], result["engine"], f"{speed:.2f}", f"{force:.0f}", judgement(result)))
    common.show((Table(("scenario", "engine", "speed [m/s]", "peak force [N]", "verdict"), tuple(rows), (0, 1, 4)),))
    if whole:
        write_page(whole, page, "Does it walk?")


def _next(stations: list[Station], page: Path) -> None:
    """Where the page is, and what to type next."""
    from biped.base.files import label

    first = label(stations[0].folder)
    recorded = (stations[0].folder / "recording.rrd").is_file()
    print("\nTo type next:")
    if recorded:
        print(f"  biped view {first}                             the recording, in a viewer")
    print(f"  biped video {first} --out push.gif             a clip")
    print("  biped run demo/push --set push.0.force=[300.0,0.0]   a harder push")
    print("  biped model FILE                                     what your own robot's file is recognised as")
    print(f"\nThe page: {label(page)}")


def is_compiled() -> bool:
    """Whether this installation has compiled kernels, of its own or shipped with it."""
    from biped.base.kernels import cache_folder
    from biped.base.objects import shipped_folder

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
    from biped.ensemble.executor import workers

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
