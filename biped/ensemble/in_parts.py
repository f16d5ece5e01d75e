"""A campaign whose rows lie in files: a large one, one on a cluster, one in shards; each can go on from any other.

At its end its files of rows agree, and become a few, the same bytes however they came.

Last seconds are kept of some of its runs that fell: of millions nobody looks at all. Which ones depends on the rows
alone, not on who made them when; they are made again, which is exact.
"""

from __future__ import annotations

import os
import tempfile
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import label
from biped.ensemble import parts
from biped.ensemble.backend import Jobs, Told, at_most
from biped.ensemble.campaign import run_one
from biped.ensemble.chunks import Chunks, run_chunks
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.executor import Map, workers
from biped.ensemble.failures import FAILURES, SUFFIX, keep, save_packed
from biped.ensemble.folder import Folder
from biped.ensemble.parts import (
    GROUP,
    About,
    Chunk,
    FinishedChunk,
    PartFile,
    PartRange,
    cover,
    digest,
    name,
    rows_of,
    writer_to,
)
from biped.ensemble.plan import Plan
from biped.ensemble.rows import RAISED, Row
from biped.measure.metrics.walking import outcome
from biped.scenario.laws import own_law

if TYPE_CHECKING:
    import pyarrow

LARGEST = 128 * 2**20
"""[bytes] of a file."""


def agree(parts: Sequence[PartFile]) -> None:
    """Makes sure that files say the same of runs that several of them hold.

    Raises:
        InputError: They do not.
    """
    active: list[PartFile] = []
    for part in parts:
        active = [other for other in active if other.last >= part.first]
        for other in active:
            _same(other, part)
        active.append(part)


def _same(one: PartFile, other: PartFile) -> None:
    lost = {*one.about.lost, *other.about.lost}
    at, last = max(one.first, other.first), min(one.last, other.last)
    while at <= last:
        upto = min(last, at + GROUP - 1)
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


def _rows(part: PartFile, first: int, last: int) -> pyarrow.Table:
    import pyarrow as pa

    table = pa.Table.from_batches(rows_of([PartRange(part, first, last)]))
    return table.replace_schema_metadata(None).combine_chunks()


def compact(folder: Path, parts: Sequence[PartFile]) -> None:
    """Writes all rows anew, in order, into files of at most `LARGEST`, and removes the others.

    Stopped in between, the folder holds some rows twice, which the next time finds.

    Args:
        folder: The folder.
        parts: Its files, which agree.

    Raises:
        OSError: It cannot be written to.
        InputError: A file is damaged.
    """
    pieces = cover(parts)
    if all(part.about.compact for part in parts) and pieces == [
        PartRange(part, part.first, part.last) for part in parts
    ]:
        return
    lost = sorted({number for part in parts for number in part.about.lost})
    lost = [
        number for number in lost if any(p.first <= number <= p.last and number in p.part.about.lost for p in pieces)
    ]
    platforms = tuple(sorted({platform for part in parts for platform in part.about.platforms}))
    about = About(parts[0].about.origin, platforms, tuple(lost), compact=True)
    kept: set[Path] = set()
    file: _GroupFile | None = None
    try:
        for group in _regrouped(rows_of(pieces)):
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
    for part in parts:
        if part.path not in kept:
            part.path.unlink(missing_ok=True)
    for left in folder.glob(".*.part"):  # by whoever was killed
        left.unlink(missing_ok=True)


class _GroupFile:
    """A file that is being written."""

    def __init__(self, folder: Path, about: About, group: pyarrow.Table):
        self._folder, self._about = folder, about
        self._first = self._next = group.column("index")[0].as_py()
        self._path = folder / f".{self._first:08d}.part"
        self._sink = open(self._path, "wb")  # noqa: SIM115 (open for as long as rows come)
        self._writer = writer_to(self._sink, group.schema)
        self._largest = 0

    @property
    def full(self) -> bool:
        """Whether another group of rows would make it too large."""
        return self._sink.tell() + 2 * self._largest > LARGEST

    def write(self, group: pyarrow.Table) -> None:
        before = self._sink.tell()
        self._writer.write_table(group, row_group_size=GROUP)
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
            path = self._folder / name(self._first, self._next - 1, digest(written))
        self._path.replace(path)
        return path

    def abandon(self) -> None:
        with suppress(OSError):
            self._writer.close()
        with suppress(OSError):
            self._sink.close()
        self._path.unlink(missing_ok=True)


def _regrouped(batches: Iterator[pyarrow.RecordBatch]) -> Iterator[pyarrow.Table]:
    """Tables of `GROUP` rows, the last perhaps of fewer."""
    import pyarrow as pa

    held: list[pyarrow.RecordBatch] = []
    count = 0
    for batch in batches:
        held.append(batch.replace_schema_metadata(None))
        count += len(batch)
        while count >= GROUP:
            table = pa.Table.from_batches(held)
            yield table.slice(0, GROUP).combine_chunks()
            held = table.slice(GROUP).to_batches()
            count -= GROUP
    if held:
        yield pa.Table.from_batches(held).combine_chunks()


LARGE = 10_000
"""Most runs whose rows result.json holds."""
LATELY = 256
"""Chunks that say who works at the moment."""


class InParts:
    """A campaign's rows in files.

    Args:
        plan: The campaign.
        folder: Of the files.
        commit: Puts rows there.
        tell: Told what a person should know.
        same: Whether rows of another kind of machine are refused.

    Raises:
        InputError: There are rows of something else.
    """

    def __init__(
        self, plan: Plan, folder: Path, commit: Callable[[FinishedChunk], None], tell: Told, same: bool = False
    ):
        self._plan, self._folder, self._commit, self._tell = plan, folder, commit, tell
        self._chunks = Chunks(plan)
        self._there = self._survey()
        self._same = same
        self._platforms: set[str] = {self._chunks.platform}
        for part in self._there:
            self._met(part.about.platforms)

    def _survey(self) -> list[parts.PartFile]:
        """The files that are there and whole; others are set aside."""
        found, about = [], self._chunks.about()
        for path in sorted(self._folder.glob("*.parquet")):
            if not path.is_file():
                self._tell(f"{label(path)}: is no file: left alone")
                continue
            try:
                part = parts.read(path)
                if not parts.sound(part):
                    raise InputError(f"{label(path)}: damaged")
            except InputError as error:
                path.replace(path.with_suffix(".damaged"))
                self._tell(f"{str(error).partition(';')[0]}: set aside as {path.stem}.damaged, its runs are made again")
                continue
            if part.about.origin != about.origin or part.last >= len(self._plan):
                raise InputError(_differs(path, part.about.origin, about.origin))
            found.append(part)
        return sorted(found, key=lambda part: (part.first, part.last))

    def _met(self, platforms: Iterable[str]) -> None:
        """Says, once, that rows are of another kind of machine."""
        for platform in platforms:
            if platform not in self._platforms:
                if self._same:
                    raise InputError(
                        f"{label(self._folder)}: holds rows made on {platform}; here is {self._chunks.platform}: "
                        "refused by --same-platform"
                    )
                self._platforms.add(platform)
                self._tell(
                    f"some runs are made on {platform}, others on {self._chunks.platform}: last digits may differ"
                )

    def missing(self, wanted: range) -> list[range]:
        """Numbers of the runs that are to be made; a lost one is made again."""
        left = parts.missing(parts.cover(self._there, lost=False), len(self._plan))
        cut = (range(max(some.start, wanted.start), min(some.stop, wanted.stop)) for some in left)
        return [some for some in cut if some]

    def adopt(self, rows: Sequence[Row]) -> None:
        """Takes rows over that a journal holds, in order."""
        wanted = {number for some in self.missing(range(len(self._plan))) for number in some}
        rows = [row for row in rows if row.index in wanted]
        ends = [i for i, (one, next_) in enumerate(pairwise(rows), 1) if next_.index != one.index + 1]
        for first, last in pairwise([0, *ends, len(rows)]):
            if last > first:
                self._commit(self._chunks.of(rows[first:last]))
        self._there = self._survey()

    def make(self, jobs: Jobs, wanted: range, advance: Callable[..., None]) -> None:
        """Makes what is missing.

        Args:
            jobs: Who does.
            wanted: Numbers of the runs that are wanted.
            advance: Called with how many runs are finished, and who works.
        """
        left = self.missing(wanted)
        if left:
            lately: deque[tuple[str, int]] = deque(maxlen=LATELY)
            with workers(self._chunks, at_most(jobs, sum(map(len, left)))) as carried_out:
                for done in run_chunks(self._chunks, left, carried_out):
                    self._met([done.platform])
                    self._commit(done)
                    lately.append((done.by, done.chunk.runs))
                    advance(done.chunk.runs, _words(carried_out, lately))
        self._there = parts.listed(self._folder)

    def finish(self) -> StoredRows:
        """All rows, in a few files.

        Raises:
            InputError: Files do not agree.
            OSError: They cannot be written.
        """
        agree(self._there)
        compact(self._folder, self._there)
        self._there = parts.listed(self._folder)
        return StoredRows(parts.cover(self._there))


def _words(carried_out: Map[Chunk, FinishedChunk], lately: Iterable[tuple[str, int]]) -> str:
    """Who works, and what share of the runs each made lately."""
    words = carried_out.words
    shares: Counter[str] = Counter()
    for by, runs in lately:
        shares[by] += runs
    if not words or len(shares) < 2:
        return words
    low, high = (100.0 * share / shares.total() for share in (min(shares.values()), max(shares.values())))
    return f"{words}, {low:.2g} – {high:.2g} % each"


def _differs(path: Path, there: Any, here: Any) -> str:
    names = [name for name in {**here, **there} if there.get(name) != here.get(name)] or ["runs"]
    then, now = (", ".join(f"{name} {of.get(name, 'unknown')!s:.80}" for name in names) for of in (there, here))
    return (
        f"{label(path)}: its runs were made with {then}; here is {now}: runs of the two are not mixed; choose another "
        "folder, or remove the file to make its runs again"
    )


LAST_SECONDS = 3.0
"""[s] of trajectory kept of a run that fell in a campaign."""
POINTS = 100
"""Most points of a sweep of which any are kept: so many, evenly spread."""


class LastSeconds(NamedTuple):
    """The end of a run.

    Attributes:
        index: Its number.
        cause: What became of it.
        data: Its last seconds, as a file.
        traceback: Of a law of the user's own that raised.
    """

    index: int  # pyright: ignore[reportIncompatibleMethodOverride]
    cause: str
    data: bytes
    traceback: str


class Endings:
    """Makes runs of a plan again for their last seconds.

    Args:
        plan: The campaign.
    """

    def __init__(self, plan: Plan):
        self._plan = plan

    def __call__(self, index: int) -> LastSeconds:
        """The end of run `index`."""
        trajectory, row = run_one(self._plan, index)
        with tempfile.TemporaryDirectory(prefix="biped-") as folder:
            path = Path(folder) / f"ending{SUFFIX}"
            save_packed(trajectory.last(LAST_SECONDS), path)
            return LastSeconds(index, outcome(row.as_dict()), path.read_bytes(), trajectory.traceback)


def chosen(plan: Plan, rows: StoredRows) -> Iterator[int]:
    """Numbers of the runs to keep: the first few that fell or are doubtful at each of some points."""
    most, runs, points = plan.scenario.failures.keep, plan.scenario.randomise.runs, len(plan.points)
    looked_at = {i * points // min(points, POINTS) for i in range(min(points, POINTS))}
    at, found = -1, 0
    for columns in batches(rows, ("index", "fell", "doubtful", "end")):
        for index in columns["index"][columns["fell"] | columns["doubtful"] | (columns["end"] == RAISED)]:
            point = int(index) // runs
            at, found = point, found if point == at else 0
            if found < most and point in looked_at:
                found += 1
                yield int(index)


def keep_some(plan: Plan, rows: StoredRows, where: Folder, jobs: Jobs) -> None:
    """Keeps the last seconds of some runs, and the commands that make them again.

    Args:
        plan: The campaign.
        rows: What came of it.
        where: Its results folder.
        jobs: Who makes them.

    Raises:
        RunError: They cannot be written.
    """
    kept = where.path / FAILURES
    left = [index for index in chosen(plan, rows) if not (kept / f"run-{index:05d}.txt").exists()]
    more = " --trust" if own_law(plan.scenario.law) else ""
    with workers(Endings(plan), at_most(jobs, len(left))) as carried_out:
        for ending in carried_out(left, lost=_nothing):
            if ending is not None:
                keep(where.path, ending.index, ending.cause, partial(_write, data=ending.data), more, ending.traceback)


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)


def _nothing(index: int, error: BaseException) -> Any:
    """Keeps nothing of a run that cost too many workers."""
