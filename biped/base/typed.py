"""Plain data into typed records, from any thread.

msgspec works out a type when it is first converted to, and ends the process where two threads do so at once.
"""

import os
from collections.abc import Hashable
from threading import RLock
from typing import Any

import msgspec

_lock = RLock()
_known: set[Hashable] = set()


def convert(data: Any, kind: Any) -> Any:
    """Converts plain data as `msgspec.convert` does.

    Args:
        data: What TOML or JSON holds.
        kind: A type, such as a `msgspec.Struct` or `dict[str, float]`.

    Raises:
        msgspec.ValidationError: It is of another type.
    """
    if kind not in _known:
        with _lock:
            msgspec.json.Decoder(kind)
            _known.add(kind)
    return msgspec.convert(data, kind)


def _anew() -> None:
    """A forked process has a lock of its own: the thread that held it was not forked."""
    global _lock
    _lock = RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_anew)
