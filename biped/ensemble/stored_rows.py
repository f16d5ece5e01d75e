"""Rows of a large campaign where they lie: read in pieces, as often as they are asked for."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.text import plain
from biped.ensemble.columns import TYPES, Columns, InPieces
from biped.ensemble.parts import FOLDER, PartRange, cover, listed, missing, rows_of, sound
from biped.ensemble.table import records

if TYPE_CHECKING:
    import pyarrow


class StoredRows(InPieces, Sequence[dict[str, Any]]):
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
        """See `biped.ensemble.columns.batches`."""
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
