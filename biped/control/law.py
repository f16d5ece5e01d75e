"""What an engine needs of any control law, the thesis's or a user's own."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from biped.base.errors import InputError

Tick = Callable[[int, float], int]


class Signals(NamedTuple):
    """What a law logs of its own.

    Attributes:
        names: Of its signals.
        values: (n, len(names)) one row per tick, nan where it said nothing.
    """

    names: tuple[str, ...]
    values: np.ndarray


NO_SIGNALS = Signals((), np.empty((0, 0)))


class Raised(InputError):
    """A law that failed at a tick: before the first there is nothing to keep, afterwards the run ends there.

    Args:
        message: One paragraph.
        tick: Number of the tick.
        cause: How the run ended, in words that end in the time and the reason.
        traceback: Where in the law, as Python says it; empty if it did not raise.
    """

    def __init__(self, message: str, tick: int, cause: str, traceback: str):
        super().__init__(message, "law")
        self.tick, self.cause, self.traceback = tick, cause, traceback


class Law(Protocol):
    """What an engine needs of a control law.

    A law is bound to the measured coordinates of one run and ticks through it; what it wants is left in `u` and `Q_d`.

    Attributes:
        u: (6,) joint torques of the latest tick [N m].
        Q_d: (9,) desired generalized forces of the latest tick.
        record: (1,) `biped.control.record.CONTROL`, which senses contacts and says what a fall is.
        signals: What it logs of its own.
    """

    u: np.ndarray
    Q_d: np.ndarray
    record: np.ndarray
    signals: Signals

    @property
    def tick(self) -> Tick:
        """One control tick (k, time [s]) from the bound measurements; returns a status of `biped.control.tick`."""
        ...


def numbers(told: object) -> np.ndarray:
    """What a law returned as an array of floats.

    Raises:
        TypeError: It is not of real numbers: nothing imaginary, masked or in words passes as what it is not.
        ValueError: It has no shape.
    """
    found = np.asarray(told)
    if found.dtype.kind not in "biufO" or np.ma.is_masked(told):
        raise TypeError(f"numbers of {found.dtype}")
    return found.astype(float, copy=False)
