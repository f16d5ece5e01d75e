"""A campaign whose rows lie in files: a large one, one on a cluster, one in shards; each can go on from any other.

At its end its files of rows agree, and become a few, the same bytes however they came.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import label
from biped.ensemble import parts
from biped.ensemble.backend import Jobs, Told, at_most
from biped.ensemble.chunks import Chunks, run_chunks
from biped.ensemble.columns import StoredRows
from biped.ensemble.executor import Map, workers
from biped.ensemble.merging import agree, compact
from biped.ensemble.plan import Plan
from biped.ensemble.rows import Row

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
        self, plan: Plan, folder: Path, commit: Callable[[parts.FinishedChunk], None], tell: Told, same: bool = False
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


def _words(carried_out: Map[parts.Chunk, parts.FinishedChunk], lately: Iterable[tuple[str, int]]) -> str:
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
