"""The protocol of a compiled law of seven links in a plane, which a run's loop ticks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from biped.control.law import Signals

Tick = Callable[[int, float], int]


class Law(Protocol):
    """The protocol of a control law in an engine.

    A law is bound to the measured coordinates of one run and ticks through it; what it wants is left in `u` and `Q_d`.

    Attributes:
        u: (6,) joint torques of the latest tick [N m].
        Q_d: (9,) desired generalized forces of the latest tick.
        record: (1,) `biped.control.planar.record.CONTROL`, which senses contacts and says what a fall is.
        signals: What it logs of its own.
    """

    u: np.ndarray
    Q_d: np.ndarray
    record: np.ndarray
    signals: Signals

    @property
    def tick(self) -> Tick:
        """One control tick (k, time [s]) from bound measurements; returns a status of `biped.control.planar.tick`."""
        ...
