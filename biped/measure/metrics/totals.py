"""Numbers of an ensemble from its runs in pieces: however many there are, they take no more memory than a piece."""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from biped.scenario.metrics import METRICS

BLOCK = 1 << 16
"""Numbers that are added up at a time."""


class RunningMean:
    """The mean of numbers that come in pieces, without those that do not exist.

    Its digits depend on the numbers in their order, not on where the pieces end: blocks of a fixed length are added up
    by themselves, their sums without rounding.
    """

    def __init__(self):
        self._held: list[np.ndarray] = []
        self._waiting = 0
        self._sums: list[float] = []
        self._count = 0

    def add(self, values: np.ndarray) -> None:
        """More numbers."""
        finite = values[np.isfinite(values)]
        self._count += finite.size
        while self._waiting + finite.size >= BLOCK:
            room = BLOCK - self._waiting
            self._held.append(finite[:room])
            self._sums.append(float(np.add.reduce(np.concatenate(self._held))))
            self._held, self._waiting, finite = [], 0, finite[room:]
        if finite.size:
            self._held.append(finite)
            self._waiting += finite.size

    @property
    def value(self) -> float:
        """The mean so far; nan of nothing."""
        rest = [float(np.add.reduce(np.concatenate(self._held)))] if self._held else []
        try:
            return math.fsum(self._sums + rest) / self._count if self._count else math.nan
        except OverflowError:
            return math.inf


class Totals:
    """Numbers of an ensemble whose runs come in pieces: counts of outcomes, and means over the runs that walked.

    Where none walked, means are over the runs that have the number; nan if none has.

    Args:
        names: The metrics that are asked for; default: all.
    """

    def __init__(self, names: Iterable[str] = METRICS):
        metrics = [METRICS[name] for name in names]
        self._names = [metric.name for metric in metrics]
        self._counts = {metric.name: 0 for metric in metrics if metric.kind == "count"} | {"walked": 0}
        means = [metric.name for metric in metrics if metric.kind != "count"]
        self._walkers = {name: RunningMean() for name in means}
        self._all = {name: RunningMean() for name in means}
        self.runs = 0

    def add(self, columns: Mapping[str, np.ndarray]) -> None:
        """More runs.

        Args:
            columns: (n,) values by metric; `walked` and every metric that was asked for.
        """
        walked = columns["walked"].astype(bool)
        self.runs += walked.size
        for name in self._counts:
            self._counts[name] += int(columns[name].sum())
        if not self._counts["walked"]:
            for name, mean in self._all.items():
                mean.add(columns[name])
        elif walked.any():
            for name, mean in self._walkers.items():
                mean.add(columns[name][walked])

    @property
    def numbers(self) -> dict[str, float]:
        """Counts, and means over the runs that walked; where none did, over all that have the number."""
        means = self._walkers if self._counts["walked"] else self._all
        return {name: self._counts[name] if name in self._counts else means[name].value for name in self._names}
