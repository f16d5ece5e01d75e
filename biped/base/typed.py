"""Typed records of plain data: numbers with bounds, tables of files, and their conversion from any thread.

msgspec works out a type when it is first converted to, and ends the process where two threads do so at once.

No number of a walk comes near these bounds: they keep what is computed from a number (ticks, buffers, squares) within
what a machine holds, so that nothing behind them has to ask again.
"""

import os
from collections.abc import Hashable
from threading import RLock
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

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


LARGEST = 1e15
"""Of any number: its square, and products of a few of them, are still finite."""

Real = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Meta(gt=0, le=LARGEST)]
NonNegative = Annotated[float, Meta(ge=0, le=LARGEST)]
Factor = Annotated[float, Meta(ge=1e-6, le=1e6)]
"""Of what is a number of the model's."""
Degrees = Annotated[float, Meta(ge=-36000, le=36000)]
Hold = Annotated[float, Meta(ge=0, le=1000)]
"""[s] for which something is waited for."""
Count = Annotated[int, Meta(ge=1, le=1_000_000)]
Name = Annotated[str, Meta(max_length=4000)]
Names = Annotated[tuple[Name, ...], Meta(max_length=1000)]
Force = Annotated[tuple[Real, ...], Meta(min_length=2, max_length=3)]
"""In the plane forward and up, in space forward, to the left and up."""
Four = tuple[Degrees, Degrees, Degrees, Degrees]
Springs = tuple[NonNegative, NonNegative, NonNegative, NonNegative]
Nine = tuple[Real, Real, Real, Real, Real, Real, Real, Real, Real]
Six = tuple[Real, Real, Real, Real, Real, Real]
Seven = Annotated[tuple[Factor, ...], Meta(min_length=7, max_length=7)]


class Section(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of a scenario file."""
