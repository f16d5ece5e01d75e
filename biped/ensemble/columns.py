"""Rows of a campaign, in memory or in files: columns in pieces for whoever asks for a few numbers of many runs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biped.base.errors import InputError, plain
from biped.base.files import label
from biped.ensemble.parts import FOLDER, PartRange, cover, listed, missing, rows_of, sound
from biped.ensemble.rows import records

if TYPE_CHECKING:
    import pyarrow


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
        runs: Rows as in result.json, or `StoredRows`.
        names: Names of columns; `falls` is `fell`.
    """
    if isinstance(runs, StoredRows):
        yield from runs.batches(names)
    elif runs:
        yield {name: column(name, [run.get("fell" if name == "falls" else name) for run in runs]) for name in names}


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


class StoredRows(Sequence[dict[str, Any]]):
    """Rows in files: a sequence of records as in result.json, and columns in pieces.

    Texts may be anybody's: control characters in them are written out.

    Args:
        pieces: Where they are, in their order.
    """

    def __init__(self, pieces: Sequence[PartRange]):
        self.pieces = list(pieces)
        self._begins = np.cumsum([0, *(piece.last - piece.first + 1 for piece in self.pieces)])

    def __len__(self) -> int:
        return int(self._begins[-1])

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return [self[i] for i in range(*place.indices(len(self)))]
        if not -len(self) <= place < len(self):
            raise IndexError(place)
        place %= len(self)
        which = int(np.searchsorted(self._begins, place, side="right")) - 1
        piece = self.pieces[which]
        number = piece.first + place - int(self._begins[which])
        return next(self._records([PartRange(piece.part, number, number)]))

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return self._records(self.pieces)

    def of(self, numbers: Collection[int]) -> list[dict[str, Any]]:
        """The rows of some runs, each group of rows read once.

        Args:
            numbers: Of the runs; those that are not there are left out.
        """
        return list(self._records(self.pieces, numbers))

    @staticmethod
    def _records(pieces: Sequence[PartRange], among: Collection[int] | None = None) -> Iterator[dict[str, Any]]:
        for batch in rows_of(pieces, among=among):
            for record in records(batch):
                yield _harmless(record)

    def batches(self, names: Sequence[str]) -> Iterator[Columns]:
        """See the function `batches`."""
        columns = {name: "fell" if name == "falls" else name for name in names}
        for batch in rows_of(self.pieces, list(dict.fromkeys(columns.values()))):
            there = set(batch.schema.names)
            try:
                yield {
                    name: _array(batch.column(column), column) if column in there else np.full(len(batch), np.nan)
                    for name, column in columns.items()
                }
            except (ValueError, TypeError) as error:
                where = label(self.pieces[0].part.path)
                raise InputError(f"{where}: expected rows of a campaign: {plain(error)[:200]}") from None

    def table(self) -> pyarrow.Table:
        """All rows at once."""
        import pyarrow as pa

        return pa.Table.from_batches(rows_of(self.pieces)).replace_schema_metadata(None)


def _array(values: pyarrow.Array, name: str) -> np.ndarray:
    if TYPES.get(name) is object:
        return np.array([None if text is None else plain(text) for text in values.to_pylist()], dtype=object)
    return values.to_numpy(zero_copy_only=False).astype(TYPES.get(name, float), copy=False)


def _harmless(value: Any) -> Any:
    if isinstance(value, dict):
        return {plain(key): _harmless(inner) for key, inner in value.items()}
    return plain(value) if isinstance(value, str) else value


def stored_rows(folder: Path, count: int) -> StoredRows:
    """The rows of a finished campaign.

    Args:
        folder: Its results folder.
        count: How many there are.

    Raises:
        InputError: They are not all there.
    """
    where = folder / FOLDER
    files = listed(where) if where.is_dir() else []
    for part in files:
        if not sound(part):
            raise InputError(
                f"{label(part.path)}: damaged; remove it, and the same command with --out makes its runs again"
            )
    pieces = cover(files)
    rows = StoredRows(pieces)
    if len(rows) != count or missing(pieces, count):
        raise InputError(
            f"{label(where)}: expected the rows of {count} runs, there are {len(rows)}; the same command with --out "
            "makes the others again"
        )
    return rows
