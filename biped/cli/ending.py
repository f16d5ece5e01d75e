"""How a command ends that does not end well: one paragraph, an exit code, and the traceback only for who asks."""

from __future__ import annotations

import sys

from biped.base.errors import BipedError, InputError
from biped.base.text import paragraph

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
    return isinstance(error, InputError)


def _words(error: Exception) -> str:
    if isinstance(error, BipedError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"out of memory: {error or 'expected'} a shorter run, a slower control rate or fewer --jobs"
    if isinstance(error, OSError):
        files = ", ".join(str(name) for name in (error.filename, error.filename2) if name is not None)
        return f"{files or 'the system'}: {(error.strerror or str(error) or type(error).__name__).lower()}"
    return (
        f"a defect of biped, not of what you wrote: {type(error).__name__}: {error}; "
        f"the same command with {DEBUG} shows where, for a report"
    )
