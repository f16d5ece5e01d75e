"""Merging of a campaign's files of rows: they agree on runs that several hold, and become a few, all rows in order.

What comes of it are the same bytes, however many files there were and whatever each held.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from biped.base.errors import InputError
from biped.base.files import label
from biped.ensemble import parts

if TYPE_CHECKING:
    import pyarrow

LARGEST = 128 * 2**20
"""[bytes] of a file."""


def agree(files: Sequence[parts.PartFile]) -> None:
    """Makes sure that files say the same of runs that several of them hold.

    Raises:
        InputError: They do not.
    """
    active: list[parts.PartFile] = []
    for part in files:
        active = [other for other in active if other.last >= part.first]
        for other in active:
            _same(other, part)
        active.append(part)


def _same(one: parts.PartFile, other: parts.PartFile) -> None:
    lost = {*one.about.lost, *other.about.lost}
    at, last = max(one.first, other.first), min(one.last, other.last)
    while at <= last:
        upto = min(last, at + parts.GROUP - 1)
        mine, theirs = (_rows(part, at, upto) for part in (one, other))
        if not mine.equals(theirs):
            for i in range(len(mine)):
                if at + i not in lost and mine.slice(i, 1) != theirs.slice(i, 1):
                    where = [" / ".join(part.about.platforms) for part in (one, other)]
                    places = f" (made on {where[0]}, and on {where[1]})" if where[0] != where[1] else ""
                    raise InputError(
                        f"{label(one.path)} and {label(other.path)} say different things of run {at + i}{places}; "
                        "remove the one that is wrong"
                    )
        at = upto + 1


def _rows(part: parts.PartFile, first: int, last: int) -> pyarrow.Table:
    import pyarrow as pa

    table = pa.Table.from_batches(parts.rows_of([parts.PartRange(part, first, last)]))
    return table.replace_schema_metadata(None).combine_chunks()


def compact(folder: Path, files: Sequence[parts.PartFile]) -> None:
    """Writes all rows anew, in order, into files of at most `LARGEST`, and removes the others.

    Stopped in between, the folder holds some rows twice, which the next time finds.

    Args:
        folder: The folder.
        files: Its files of rows, which agree.

    Raises:
        OSError: It cannot be written to.
        InputError: A file is damaged.
    """
    pieces = parts.cover(files)
    if all(part.about.compact for part in files) and pieces == [
        parts.PartRange(part, part.first, part.last) for part in files
    ]:
        return
    lost = sorted({number for part in files for number in part.about.lost})
    lost = [
        number for number in lost if any(p.first <= number <= p.last and number in p.part.about.lost for p in pieces)
    ]
    platforms = tuple(sorted({platform for part in files for platform in part.about.platforms}))
    about = parts.About(files[0].about.origin, platforms, tuple(lost), compact=True)
    kept: set[Path] = set()
    file: _GroupFile | None = None
    try:
        for group in _regrouped(parts.rows_of(pieces)):
            if file is not None and file.full:
                kept.add(file.close())
                file = None
            file = _GroupFile(folder, about, group) if file is None else file
            file.write(group)
        if file is not None:
            kept.add(file.close())
            file = None
    finally:
        if file is not None:
            file.abandon()
    for part in files:
        if part.path not in kept:
            part.path.unlink(missing_ok=True)
    for left in folder.glob(".*.part"):  # by whoever was killed
        left.unlink(missing_ok=True)


class _GroupFile:
    """A file that is being written."""

    def __init__(self, folder: Path, about: parts.About, group: pyarrow.Table):
        self._folder, self._about = folder, about
        self._first = self._next = group.column("index")[0].as_py()
        self._path = folder / f".{self._first:08d}.part"
        self._sink = open(self._path, "wb")  # noqa: SIM115 (open for as long as rows come)
        self._writer = parts.writer_to(self._sink, group.schema)
        self._largest = 0

    @property
    def full(self) -> bool:
        """Whether another group of rows would make it too large."""
        return self._sink.tell() + 2 * self._largest > LARGEST

    def write(self, group: pyarrow.Table) -> None:
        before = self._sink.tell()
        self._writer.write_table(group, row_group_size=parts.GROUP)
        self._largest = max(self._largest, self._sink.tell() - before)
        self._next += len(group)

    def close(self) -> Path:
        lost = tuple(number for number in self._about.lost if self._first <= number < self._next)
        self._writer.add_key_value_metadata(self._about._replace(lost=lost).metadata())
        self._writer.close()
        self._sink.flush()
        os.fsync(self._sink.fileno())
        self._sink.close()
        with open(self._path, "rb") as written:
            path = self._folder / parts.name(self._first, self._next - 1, parts.digest(written))
        self._path.replace(path)
        return path

    def abandon(self) -> None:
        with suppress(OSError):
            self._writer.close()
        with suppress(OSError):
            self._sink.close()
        self._path.unlink(missing_ok=True)


def _regrouped(batches: Iterator[pyarrow.RecordBatch]) -> Iterator[pyarrow.Table]:
    """Tables of `parts.GROUP` rows, the last perhaps of fewer."""
    import pyarrow as pa

    held: list[pyarrow.RecordBatch] = []
    count = 0
    for batch in batches:
        held.append(batch.replace_schema_metadata(None))
        count += len(batch)
        while count >= parts.GROUP:
            table = pa.Table.from_batches(held)
            yield table.slice(0, parts.GROUP).combine_chunks()
            held = table.slice(parts.GROUP).to_batches()
            count -= parts.GROUP
    if held:
        yield pa.Table.from_batches(held).combine_chunks()
