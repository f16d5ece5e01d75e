"""Rows of a large campaign in Parquet files, each of which is there whole or not at all.

A file holds the rows of consecutive runs and is called `<first>-<last>-<digest of its bytes>.parquet`; what it holds is
done. Files may overlap where shards or machines did the same work twice: then they agree, or it is an error. A run that
cost too many workers stands in a file by itself and gives way to any other that has it. At the end all rows are written
anew, in order, into a few large files: the same bytes whoever made them in whatever pieces.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from hashlib import blake2b
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np

from biped.base.errors import InputError, why
from biped.base.files import label
from biped.base.writing import written

if TYPE_CHECKING:
    import pyarrow
    from pyarrow.parquet import ParquetFile

FOLDER = "parts"
FORMAT = 1
ABOUT = b"biped"
"""Key of the schema's metadata that says what rows are of and what they were made with."""
GROUP = 16_384
"""Rows that are written, and read, at a time."""
MOST = 256 * 2**20
"""[bytes] of a group of rows that is read: ours have 10; more is not one of ours."""


NEEDED = {
    "index": "int64", "fell": "bool", "walked": "bool", "end": "string", "cause": "string", "time": "double",
}  # fmt: skip
"""Columns without which there are no rows."""


class About(NamedTuple):
    """The origin of rows: their campaign and the program that computed them.

    Attributes:
        origin: Scenario and versions (`biped.ensemble.journal`).
        platforms: Where: system, C library and instructions of every kind of machine.
        lost: Numbers of the runs that are lost.
        compact: Whether the file is one of the last ones, when all is done.
    """

    origin: Mapping[str, str]
    platforms: tuple[str, ...]
    lost: tuple[int, ...] = ()
    compact: bool = False

    def metadata(self) -> dict[bytes, bytes]:
        """As a file's metadata, which readers find in its schema's."""
        return {ABOUT: json.dumps({"format": FORMAT, **self._asdict()}, sort_keys=True).encode()}


class Chunk(NamedTuple):
    """Runs first … first + runs - 1."""

    first: int
    runs: int


class FinishedChunk(NamedTuple):
    """Rows of a finished chunk.

    Attributes:
        chunk: Which.
        data: Its rows, as the file that they will be.
        seconds: [s] that its runs took.
        by: Who made it.
        platform: On what kind of machine.
    """

    chunk: Chunk
    data: bytes
    seconds: float
    by: str
    platform: str


class PartFile(NamedTuple):
    """A file of rows first … last."""

    path: Path
    first: int
    last: int
    about: About


class PartRange(NamedTuple):
    """Rows first … last of a file."""

    part: PartFile
    first: int
    last: int


def encoded(table: pyarrow.Table, about: About) -> bytes:
    """A table as the bytes of a file."""
    import pyarrow as pa

    sink = pa.BufferOutputStream()
    with writer_to(sink, table.schema) as writer:
        writer.write_table(table, row_group_size=GROUP)
        writer.add_key_value_metadata(about.metadata())
    return sink.getvalue().to_pybytes()


def writer_to(sink: Any, schema: pyarrow.Schema) -> Any:
    """A writer of rows as Parquet, whose pages carry checksums."""
    import pyarrow as pa
    from pyarrow.parquet import ParquetWriter

    words = [field.name for field in schema if pa.types.is_string(field.type)]
    told = [name for name in schema.names if name in ("index", "walked") or name.startswith("values.")]
    settings: dict[str, Any] = {"use_dictionary": words, "write_statistics": told, "write_page_checksum": True}
    return ParquetWriter(sink, schema, compression="zstd", **settings)


def listed(folder: Path) -> list[PartFile]:
    """The files of a folder of parts, by their first run.

    Raises:
        InputError: One is none of biped's.
    """
    files = (path for path in folder.glob("*.parquet") if path.is_file())
    return sorted(map(read, files), key=lambda part: (part.first, part.last))


def read(path: Path) -> PartFile:
    """The description that a file carries of its rows.

    Raises:
        InputError: It is damaged, or none of biped's.
    """
    import pyarrow as pa

    try:
        with _opened(path) as file:
            meta = file.metadata
            about = json.loads((meta.metadata or {})[ABOUT])
            if about.pop("format") != FORMAT:
                raise ValueError("another format")
            first, last = map(int, path.stem.split("-")[:2])
            wrong = [name for name, kind in NEEDED.items() if str(file.schema_arrow.field(name).type) != kind]
            if wrong:
                raise ValueError(f"{wrong[0]} is of another type")
            groups = [meta.row_group(i) for i in range(meta.num_row_groups)]
            if meta.num_rows != last - first + 1 or any(group.total_byte_size > MOST for group in groups):
                raise ValueError(f"{meta.num_rows} rows")
            told = About(about["origin"], tuple(about["platforms"]), tuple(about["lost"]), bool(about["compact"]))
            return PartFile(path, first, last, told)
    except (OSError, pa.ArrowException, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(
            f"{label(path)}: expected rows of a campaign: {why(error)}; remove it to have its runs made again"
        ) from None


def _opened(path: Path) -> ParquetFile:
    from pyarrow.parquet import ParquetFile

    return ParquetFile(path, page_checksum_verification=True, memory_map=False)


def sound(part: PartFile) -> bool:
    """Whether a file is the one that was written, to the last bit."""
    try:
        with open(part.path, "rb") as file:
            return part.path.name == name(part.first, part.last, digest(file))
    except OSError:
        return False


def digest(file: BinaryIO) -> str:
    """A name for the bytes of a file."""
    state = blake2b(digest_size=8)
    while data := file.read(1 << 20):
        state.update(data)
    return state.hexdigest()


def cover(parts: Sequence[PartFile], lost: bool = True) -> list[PartRange]:
    """Which file gives which rows: in order, none twice.

    Args:
        parts: Files, which may overlap.
        lost: Whether rows of lost runs count where there is no other.
    """
    whole: list[PartRange] = []
    for part in parts:
        at = part.first
        for gone in (*sorted(part.about.lost), part.last + 1):
            if gone > at:
                whole.append(PartRange(part, at, gone - 1))
            at = gone + 1
    pieces = _disjoint(whole)
    if lost:
        left = missing(pieces, max((part.last + 1 for part in parts), default=0))
        gone = {number: part for part in parts for number in part.about.lost}
        fills = [PartRange(gone[number], number, number) for some in left for number in some if number in gone]
        pieces = sorted([*pieces, *fills], key=lambda piece: piece.first)
    return pieces


def _disjoint(pieces: list[PartRange]) -> list[PartRange]:
    out: list[PartRange] = []
    reached = 0
    for piece in sorted(pieces, key=lambda piece: (piece.first, -piece.last)):
        if piece.last >= reached:
            out.append(piece._replace(first=max(piece.first, reached)))
            reached = piece.last + 1
    return out


def missing(pieces: Sequence[PartRange], total: int) -> list[range]:
    """Numbers of the runs, of so many, that no piece holds."""
    out, reached = [], 0
    for piece in pieces:
        if piece.first > reached:
            out.append(range(reached, piece.first))
        reached = piece.last + 1
    return [*out, range(reached, total)] if reached < total else out


def rows_of(
    pieces: Sequence[PartRange], columns: Sequence[str] | None = None, among: Collection[int] | None = None
) -> Iterator[pyarrow.RecordBatch]:
    """Rows of pieces, in their order, a group at a time.

    Args:
        pieces: Which.
        columns: Names of columns; those that a file lacks are left out. Default: all.
        among: Numbers of the runs wanted; groups without any of them are not read. Default: all.

    Raises:
        InputError: A file is damaged.
    """
    import pyarrow as pa

    numbers = None if among is None else np.array(sorted(among), dtype=np.int64)
    for part, first, last in pieces:
        at = part.first
        try:
            with _opened(part.path) as file:
                named = None if columns is None else [name for name in columns if name in file.schema_arrow.names]
                for group in range(file.metadata.num_row_groups):
                    count = file.metadata.row_group(group).num_rows
                    low, high = max(first, at), min(last + 1, at + count)
                    mine = None if numbers is None else numbers[(numbers >= low) & (numbers < high)] - at
                    if high > low and (mine is None or mine.size):
                        rows = file.read_row_group(group, columns=named, use_threads=False)
                        rows = rows.slice(low - at, high - low) if mine is None else rows.take(mine)
                        yield from rows.combine_chunks().to_batches()
                    at += count
        except (OSError, pa.ArrowException, ValueError) as error:
            raise InputError(
                f"{label(part.path)}: damaged: {why(error)}; remove it, and the same command with --out makes its runs "
                "again"
            ) from None


def commit_to(folder: Path, made: FinishedChunk) -> None:
    """Puts rows into a folder of parts: on disk, under their name, when this returns.

    Raises:
        OSError: They cannot be written.
    """
    first, runs = made.chunk
    with written(folder / name(first, first + runs - 1, digest(BytesIO(made.data)))) as part:
        part.write_bytes(made.data)


def name(first: int, last: int, digest: str) -> str:
    """The name of the file with rows first … last: of other rows, it is another."""
    return f"{first:08d}-{last:08d}-{digest}.parquet"
