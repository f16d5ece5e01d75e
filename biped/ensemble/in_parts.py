"""A campaign whose rows lie in files: a large one, one on a cluster, one in shards; each can go on from any other.

Last seconds are kept of some of its runs that fell: of millions nobody looks at all. Which ones depends on the rows
alone, not on who made them when; they are made again, which is exact.
"""

import tempfile
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.progress import Told
from biped.ensemble import parts
from biped.ensemble.backend import Jobs, at_most
from biped.ensemble.campaign import run_one
from biped.ensemble.chunks import Chunks, run_chunks
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.compact import agree, compact
from biped.ensemble.executor import Map, workers
from biped.ensemble.failures import FAILURES, SUFFIX, keep, save_packed
from biped.ensemble.folder import Folder
from biped.ensemble.parts import Chunk, FinishedChunk
from biped.ensemble.plan import Plan
from biped.ensemble.rows import RAISED, Row
from biped.measure.metrics.walking import outcome
from biped.scenario.laws import own_law

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

    index: int
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
