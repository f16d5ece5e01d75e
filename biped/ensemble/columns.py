"""Columns of a campaign's rows, in pieces: whoever asks for a few numbers of many runs need not hold the runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

Columns = dict[str, np.ndarray]
"""(n,) values by name, of n runs in the order of their numbers."""

TYPES: dict[str, Any] = {
    "index": np.int64, "seed": np.int64, "end": object, "cause": object, "verdict": object, "doubt": object,
    "warnings": object, "signals": object,
    "fell": bool, "walked": bool, "diverged": bool, "doubtful": bool,
}  # fmt: skip
"""Of columns that are not numbers (float, nan where there is none)."""


def batches(runs: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Iterator[Columns]:
    """The named columns of runs, in their order.

    Args:
        runs: Rows as in result.json, or `biped.ensemble.stored.Stored`.
        names: Names of columns; `falls` is `fell`.
    """
    if isinstance(runs, InPieces):
        yield from runs.batches(names)
    elif runs:
        yield {name: column(name, [run.get("fell" if name == "falls" else name) for run in runs]) for name in names}


class InPieces:
    """Rows that are read in pieces."""

    def batches(self, names: Sequence[str]) -> Iterator[Columns]:
        """See `batches`."""
        raise NotImplementedError


def column(name: str, values: Sequence[Any]) -> np.ndarray:
    """A column from the values of rows, of which None is a number that does not exist."""
    return np.array(values, dtype=TYPES.get(name, float))


def smallest(pieces: Callable[[], Iterator[np.ndarray]], rank: int) -> float:
    """The number that `rank` others precede once all are sorted, in little memory: counted in bins, one by one.

    Args:
        pieces: Gives all numbers in pieces, as often as it is called.
        rank: 0 … their count - 1.
    """
    low, high = -np.inf, np.inf
    while True:
        below, held, extremes = 0, 0, (np.inf, -np.inf)
        inside: list[np.ndarray] | None = []
        for piece in pieces():
            below += int((piece < low).sum())
            mine = piece[(piece >= low) & (piece <= high)]
            held += mine.size
            if mine.size:
                extremes = min(extremes[0], float(mine.min())), max(extremes[1], float(mine.max()))
            if inside is not None:
                inside = [*inside, mine] if held <= HELD else None
        if inside is not None:
            return float(np.partition(np.concatenate(inside), rank - below)[rank - below])
        low, high = extremes
        if low == high:
            return low
        edges = np.linspace(low, high, BINS + 1)
        counts = sum(np.histogram(piece, edges)[0] for piece in pieces())
        bin_ = int(np.searchsorted(np.cumsum(counts), rank - below, side="right"))
        low, last = float(edges[bin_]), bin_ == BINS - 1
        high = float(edges[-1] if last else np.nextafter(edges[bin_ + 1], -np.inf))  # bins end before the next


HELD = 1 << 20
"""Most numbers that are held at a time in the search for one of a rank."""
BINS = 1 << 12
"""Bins that the others are counted in, pass by pass."""
