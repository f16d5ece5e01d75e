"""Carries out one case and says what is wrong with the answer, if anything is."""

from __future__ import annotations

import contextlib
import io
import json
import os
import resource
import signal
import sys
import tempfile
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from unittest import mock

from biped.cli.main import main
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.studies.run import plan_of
from tests.fuzz.cases import Case

SECONDS = 10
"""[s] of CPU time that a tiny case may take."""
AGAIN = 0.5
"""[s] after which a case that was told to stop, and did not, is told again."""
UNDECIDED = 3
UNDECIDING = ("certify", "diff", "check", "run")
"""Exit code of commands that ran and say that too little is known, and these commands."""
MEMORY = 1_000_000
"""[kB]"""
LONG_RUN, MANY_RUNS, MANY_CHECKS = 4000, 12, 3000
"""What is not tiny: steps of the physics, runs, draws to check. Such a case is given up: it is long, not hung."""


class TooLongError(BaseException):
    """A case asks for more than a tiny run."""


class HungError(BaseException):
    """A tiny case does not come to an end."""


@contextlib.contextmanager
def tiny() -> Iterator[None]:
    """Gives up whatever is meant to take long."""
    made, simulate, check = [0], campaign.simulate, Plan._check

    def simulate_tiny(run):
        s = run.scenario
        made[0] += 1
        if s.duration / min(s.simulation.timestep, 1.0 / s.simulation.control_rate) > LONG_RUN or made[0] > MANY_RUNS:
            raise TooLongError
        return simulate(run)

    def check_few(plan, runs):
        if runs * len(plan.points) > MANY_CHECKS:
            raise TooLongError
        return check(plan, runs)

    with mock.patch.object(campaign, "simulate", simulate_tiny), mock.patch.object(Plan, "_check", check_few):
        yield


@contextlib.contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Stops what takes more CPU time than it may, or sleeps for minutes.

    The signal may come in a callback of the garbage collector, where Python drops what is raised: it comes again.
    """

    def stop(*_):
        raise HungError

    def dropped(what):
        if what.exc_type is not HungError:
            reported(what)

    kinds = ((signal.SIGPROF, signal.ITIMER_PROF, seconds), (signal.SIGALRM, signal.ITIMER_REAL, 30 * seconds))
    reported, sys.unraisablehook = sys.unraisablehook, dropped
    before = [signal.signal(number, stop) for number, _, _ in kinds]
    for _, timer, most in kinds:
        signal.setitimer(timer, most, AGAIN)
    try:
        yield
    finally:
        for (number, timer, _), handler in zip(kinds, before, strict=True):
            signal.setitimer(timer, 0)
            signal.signal(number, handler)
        sys.unraisablehook = reported


def files(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, and every folder."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b""
        for path in folder.rglob("*")
        if path.name != "__pycache__"
    }


WARM = (
    (), ("engine=home",), ("actuation.limit=bounded", "actuation.torque_limit=1.0"), ("actuation.mode=generalized",),
    ("backstep={}", "sensors.delay=0.002"), ("truth.mass=[1,1,1,1,1,1,2]", "engine=home", "actuation.lag=0.01"),
    ("change=[{at=0.01,over=0.01}]", "push=[{at=0.01,duration=0.01,force=[10.0,0.0]}]"),
)  # fmt: skip


OTHERS = (("robot/sensors", ()), ("spatial/own", ()), ("any/walk", ()))
"""Robots of other kinds and laws: scenario and changes."""


@cache
def warm() -> None:
    """Compiles what runs need, once: a case's seconds are its own."""
    for name, changes in (*(("level_normal", changes) for changes in WARM), *OTHERS):
        words = ("duration=0.03", "window={start=0.0,end=0.03}", *changes)
        campaign.run_one(plan_of(name, words), 0)


def fault(case: Case, seconds: float = SECONDS) -> tuple[str, str | None]:
    """How a case ended, and what is wrong with that.

    Returns:
        `0`, `1`, `2` (the exit code) or `long`; and a sentence, or None.
    """
    warm()
    ended = _fault(case, seconds)
    # Kernels that had to be compiled are there at the second time; what hangs does so again.
    return _fault(case, 6 * seconds) if ended[0] == "hung" else ended


def _fault(case: Case, seconds: float) -> tuple[str, str | None]:
    here = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="biped-fuzz-") as root:
        folder = Path(root) / "deep" / "work"
        for name, data in case.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        before, most = files(Path(root)), max(MEMORY, peak())
        os.chdir(folder)
        out, err = io.StringIO(), io.StringIO()
        try:
            with (
                contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), tiny(), warnings.catch_warnings(),
                limited(seconds),
            ):  # fmt: skip
                warnings.simplefilter("always")
                code = main(case.argv)
        except TooLongError:
            return "long", None
        except HungError:
            return "hung", f"no answer within {seconds} s of CPU time"
        except SystemExit as error:
            return str(error.code), f"left by exit({error.code})"
        except BaseException as error:
            return "raised", f"{type(error).__name__} got out: {error}"
        finally:
            os.chdir(here)
        if code == UNDECIDED and case.argv[0] in UNDECIDING:
            code = 0
        wrong = _wrong(code, out.getvalue(), err.getvalue(), before, files(Path(root)), asked(case, folder, Path(root)))
        # A process that has held more before, for other tests, can only say what a case added to that.
        return str(code), wrong or ("more than 1 GB of memory" if peak() > most else None)


def asked(case: Case, folder: Path, root: Path) -> str:
    """The folder that --out names, relative to the root of the case; empty if it names none below it."""
    words = list(case.argv)
    if "--out" not in words[:-1]:
        return ""
    try:
        return str((folder / words[words.index("--out") + 1]).resolve().relative_to(root.resolve()))
    except (OSError, ValueError, RuntimeError):
        return ""


def _new(before: dict[str, bytes], after: dict[str, bytes], out_folder: str) -> set[str]:
    """What came to be in the results folder and on the way to it."""
    if not out_folder or out_folder == "." or out_folder in before:
        return set()
    made = after.keys() - before.keys()
    return {name for name in made if name.startswith(f"{out_folder}/") or f"{out_folder}/".startswith(f"{name}/")}


def peak() -> float:
    """Most memory [kB] that this process has held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1 if sys.platform == "linux" else 1000)


def _wrong(
    code: int, out: str, err: str, before: dict[str, bytes], after: dict[str, bytes], out_folder: str
) -> str | None:
    if "Traceback" in err or "a defect of biped" in err or "out of memory" in err:
        return err.strip()
    lines = err.splitlines()
    if any(not line.startswith("biped: ") for line in lines) or (code == 2 and len(lines) != 1):
        return f"not one paragraph: {err!r}"
    if any(mark in text for text in (out, err) for mark in ("\x1b", "\x07", "\x00")):
        return "a control character was printed"
    if len(err) > 1300:
        return f"{len(err)} characters of complaint"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if code == 2 and not err:
        return "exit code 2 without a word"
    if code == 1 and err:
        return f"failed: {err.strip()}"
    changed = {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
    ours = ("deep/work/runs", "deep/work/x", "deep/work/report")
    # A new folder that --out names is the results folder, wherever it is; what was there before is not.
    outside = {name for name in changed if not name.startswith(ours) and name not in _new(before, after, out_folder)}
    if outside:
        return f"written outside the results: {sorted(outside)[:5]}"
    if code == 2 and any(name.startswith("deep/work/runs") for name in changed):
        return f"left behind: {sorted(changed)[:5]}"
    for name in changed & after.keys():
        if name.endswith("result.json"):
            try:
                json.loads(after[name], parse_constant=_no_constant)
            except ValueError as error:
                return f"{error} in JSON"
    return None


def _no_constant(name: str) -> float:
    raise ValueError(name)
