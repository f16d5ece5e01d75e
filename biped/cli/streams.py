"""The process as it is found: standard output and error, and MuJoCo without its windows.

Streams may be closed, a pipe that nobody reads any more, or of a locale without our letters. Importing MuJoCo's windows
starts a process only to ask a library for its version, which takes an eighth of what ten seconds of walking cost;
whoever asks for them afterwards gets them as ever.
"""

import codecs
import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from biped.base.errors import BipedError, InputError, paragraph, safe


@contextmanager
def safe_streams() -> Iterator[None]:
    """Printing in this block cannot fail for want of a reader or a letter.

    A letter that the terminal's encoding lacks is printed by its number, as JSON writes it too. When the reader of a
    pipe has gone, the rest goes nowhere, and the command ends with the exit code that it would have had.
    """
    codecs.register_error("biped", _by_number)
    whole = sys.stdout, sys.stderr
    opened, pipes = [], []
    for name, number in (("stdout", 1), ("stderr", 2)):
        stream = getattr(sys, name)
        if stream is None:  # closed; its number must not become that of a results file
            stream = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
            opened.append(stream)
            if stream.fileno() != number:
                os.dup2(stream.fileno(), number)
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="biped")
        pipes.append(_Pipe(stream))
        setattr(sys, name, pipes[-1])
    try:
        yield
    finally:
        for stream in pipes:
            try:
                stream.flush()
            except OSError:  # a full disk, which was said where it could be
                stream.nowhere()
        sys.stdout, sys.stderr = whole
        for stream in opened:
            stream.close()


class _Pipe:
    """A stream that goes nowhere once nobody reads it."""

    def __init__(self, stream: Any):
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """See `io.TextIOBase.write`."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self.nowhere()
            return len(text)

    def flush(self) -> None:
        """See `io.IOBase.flush`."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            self.nowhere()

    def nowhere(self) -> None:
        """Lets go of whatever is printed from now on, and what is still buffered."""
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, self._stream.fileno())
        os.close(nothing)


def _by_number(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    units = error.object[error.start : error.end].encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[i]:02x}{units[i + 1]:02x}" for i in range(0, len(units), 2)), error.end


DEBUG = "--debug"


def complain(error: Exception, debug: bool) -> bool:
    """Prints what went wrong.

    Args:
        error: What a command raised.
        debug: Whether to show where.

    Returns:
        Whether it is the input's fault.
    """
    if debug:
        import traceback

        traceback.print_exception(error)
    print(f"biped: {paragraph(_words(error))}", file=sys.stderr)
    return isinstance(error, InputError) or getattr(error, "errno", None) == errno.ENAMETOOLONG


def _words(error: Exception) -> str:
    if isinstance(error, BipedError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"out of memory: {error or 'expected'} a shorter run, a slower control rate or fewer --jobs"
    if isinstance(error, OSError):
        files = ", ".join(safe(str(name)) for name in (error.filename, error.filename2) if name is not None)
        return f"{files or 'the system'}: {(error.strerror or str(error) or type(error).__name__).lower()}"
    return (
        f"a defect of biped, not of what you wrote: {type(error).__name__}: {error}; "
        f"the same command with {DEBUG} shows where, for a report"
    )


SETTING = "MUJOCO_GL"
_DRAWING = {"Renderer": "mujoco.renderer", "GLContext": "mujoco.gl_context"}
"""Libraries that draw, and the module that each comes from."""
_OF_DRAWING = ("mujoco.rendering", "mujoco.renderer", "mujoco.gl_context")


def import_mujoco() -> None:
    """Imports MuJoCo; what draws is imported when it is first asked for.

    With MUJOCO_GL somebody has said what he wants to draw with, and MuJoCo is left alone.

    Raises:
        InputError: MuJoCo cannot draw with that.
    """
    if "mujoco" in sys.modules:
        return
    if SETTING in os.environ:
        try:
            import_module("mujoco")
        except Exception as error:  # whatever a library of graphics raises that is not there
            what = f"MUJOCO_GL={safe(os.environ[SETTING])}: MuJoCo cannot draw with it: {safe(error)}"
            raise InputError(f"{what}; expected egl, osmesa or glfw, as far as it is installed, or nothing") from None
        return
    os.environ[SETTING] = "disable"
    try:
        mujoco: Any = import_module("mujoco")
    finally:
        del os.environ[SETTING]
    for name in [name for name in sys.modules if name.startswith(_OF_DRAWING)]:
        del sys.modules[name]
    for name in ("Renderer", "rendering", "renderer", "gl_context"):
        vars(mujoco).pop(name, None)
    mujoco.__getattr__ = _drawing


def _drawing(name: str) -> Any:
    """The library that a module lacks, if it is one that draws."""
    if name not in _DRAWING:
        raise AttributeError(f"module 'mujoco' has no attribute '{name}'")
    found = getattr(import_module(_DRAWING[name]), name)
    setattr(sys.modules["mujoco"], name, found)
    return found
