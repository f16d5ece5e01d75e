"""What trajectories of all robots have in common: a log of named columns, one row per control tick."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Self

import numpy as np

from biped.measure.contact import Strike, feet_down, strikes_of
from biped.robot.gravity import GRAVITY

Columns = Mapping[str, tuple[int, tuple[int, ...]]]
"""First column of each quantity in a log, and its shape."""


class Logged(ABC):
    """A log with names for its columns; behind them those of a law's own signals.

    Attributes:
        log: (n, width + signals) one row per control tick.
        tick: [s] between rows.
        signal_names: Of what a law of the user's own logged.
    """

    log: np.ndarray
    tick: float
    signal_names: tuple[str, ...]

    @property
    @abstractmethod
    def columns(self) -> Columns:
        """First column of each quantity, and its shape."""

    @property
    @abstractmethod
    def width(self) -> int:
        """Columns of the log, a law's own signals aside."""

    @property
    @abstractmethod
    def mass(self) -> float:
        """[kg] of the whole robot."""

    @property
    @abstractmethod
    def foot_force(self) -> np.ndarray:
        """(n, 2) [N] normal force of the ground under each foot."""

    @abstractmethod
    def rows(self, which: slice | np.ndarray, **changes: Any) -> Self:
        """Some rows as a trajectory of its own, with other attributes changed."""

    def __len__(self) -> int:
        return len(self.log)

    def column(self, name: str) -> np.ndarray:
        """A quantity of `columns` as an array (n, *shape); a view."""
        first, shape = self.columns[name]
        if not shape:
            return self.log[:, first]
        return self.log[:, first : first + math.prod(shape)].reshape(len(self.log), *shape)

    @property
    def time(self) -> np.ndarray:
        """(n,) [s]."""
        return self.column("time")

    @cached_property
    def down(self) -> np.ndarray:
        """(n, 2) whether each foot is on the ground, by the ground's force (`biped.measure.contact`)."""
        return feet_down(self.foot_force, self.mass * GRAVITY, self.tick)

    @cached_property
    def strikes(self) -> list[Strike]:
        """Foot strikes (row, foot) of the whole run, in time order."""
        return strikes_of(self.down, self.tick)

    def strikes_in(self, span: slice) -> list[Strike]:
        """Foot strikes (row, foot) within a span of rows; rows are those of the run."""
        return [strike for strike in self.strikes if span.start <= strike[0] < span.stop]

    @property
    def signals(self) -> dict[str, np.ndarray]:
        """What a law of the user's own logged: name to (n,), nan where it said nothing."""
        return {name: self.log[:, self.width + i] for i, name in enumerate(self.signal_names)}

    @property
    def sound(self) -> np.ndarray:
        """(n,) whether every number of a row is finite, a law's own signals aside."""
        return np.all(np.isfinite(self.log[:, : self.width]), axis=1)

    def last(self, seconds: float) -> Self:
        """The end of the run as a trajectory of its own; times stay those of the run."""
        return self.rows(slice(-max(1, round(seconds / self.tick)), None))
