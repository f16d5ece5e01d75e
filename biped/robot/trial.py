"""Work tried in a process of its own, with bounds on time and memory: what kills it is told in words."""

import faulthandler
import os
import resource
import selectors
import signal
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from biped.base.errors import InputError

MOST_SECONDS = 5
"""[s] of the processor's time; the human model takes 0.005."""
MOST_WAIT = 60.0
"""[s] by the clock, for what waits instead of working."""
MOST_BESIDES = 2048 * 2**20
"""[bytes] beyond what this process has already; where the system counts them (Linux)."""

_DONE, _COMPLAINT = b"+", b"-"


def tried(name: str, work: Callable[[], None]) -> None:
    """Does the work in a copy of this process, and throws the copy away.

    Args:
        name: Whose work it is, for the error.
        work: What to do.

    Raises:
        InputError: The work raised one, or anything else; it crashed; or it took too much time or memory.
    """
    ours, theirs = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the copy waits for none of them
        child = os.fork()
    if child == 0:
        os.close(ours)
        _work(name, work, theirs)
    os.close(theirs)
    answer = None
    try:
        answer = _answer(ours)
    finally:
        os.close(ours)
        if answer is None:
            os.kill(child, signal.SIGKILL)
        status = os.waitpid(child, 0)[1]
    if answer != _DONE:
        raise InputError(_why(name, answer, status))


def _work(name: str, work: Callable[[], None], theirs: int) -> NoReturn:
    """The copy's whole life: it leaves neither by an exception nor through what the original does at its end."""
    answer = _DONE
    try:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        faulthandler.disable()
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(nowhere, stream)
        _bound()
        work()
    except InputError as error:
        answer = _COMPLAINT + str(error).encode()
    except MemoryError:
        answer = b""
    except BaseException as error:
        # MuJoCo's word for a std::bad_alloc is that it does not know it.
        known = "unknown exception" not in str(error)
        text = f"{name}: cannot be used: {type(error).__name__}: {' '.join(str(error).split())[:300]}"
        answer = _COMPLAINT + text.encode() if known else b""
    finally:
        try:
            os.write(theirs, answer[:4096])
        finally:
            os._exit(0)


def _bound() -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    used = int(sum(os.times()[:2]))  # a copy's clock starts at nothing, but not everywhere
    seconds = used + MOST_SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    pages = Path("/proc/self/statm")
    if pages.is_file():
        held = int(pages.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        most = held + MOST_BESIDES
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _answer(ours: int) -> bytes | None:
    """All that the copy says before it ends; None if it does not end in time."""
    said, until = b"", time.monotonic() + MOST_WAIT
    with selectors.DefaultSelector() as ready:
        ready.register(ours, selectors.EVENT_READ)
        while ready.select(max(0.0, until - time.monotonic())):
            piece = os.read(ours, 4096)
            if not piece:
                return said
            said += piece
    return None


def _why(name: str, answer: bytes | None, status: int) -> str:
    """Says in words how the copy ended."""
    if answer is None:
        return f"{name}: took more than {MOST_WAIT:g} s to compile, waiting for something"
    if answer.startswith(_COMPLAINT):
        return answer[1:].decode(errors="replace")
    if os.WIFSIGNALED(status):
        killer = os.WTERMSIG(status)
        if killer in (signal.SIGXCPU, signal.SIGKILL):
            return f"{name}: took more than {MOST_SECONDS} s to compile"
        return f"{name}: crashes MuJoCo or Pinocchio ({signal.Signals(killer).name}): not a model either can compile"
    return f"{name}: takes more than {MOST_BESIDES >> 20} MB to compile"
