"""Answers of Pinocchio that are remembered beside the compiled kernels: that it agrees with a model of ours.

To import it and to have it read a model takes longer than ten seconds of walking.
"""

import hashlib
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from biped.base.kernels import cache_folder


def agreed(question: bytes, ask: Callable[[], bool]) -> bool:
    """Whether Pinocchio agrees; it is asked once, and again only while it does not.

    Args:
        question: All that the answer hangs on besides Pinocchio itself.
        ask: Asks it.
    """
    asked = hashlib.blake2b(question, digest_size=16)
    library = find_spec("pinocchio")
    if library is not None and library.origin is not None:
        asked.update(f"{library.origin} {Path(library.origin).stat().st_mtime_ns}".encode())
    note = cache_folder() / "agreed" / asked.hexdigest()
    if note.exists():
        return True
    if not ask():
        return False
    with suppress(OSError):  # it is asked again
        note.parent.mkdir(exist_ok=True)
        note.touch()
    return True
