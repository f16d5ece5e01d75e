"""Many runs as one piece of work: a large campaign is carried out, sent and committed in chunks of consecutive runs.

What travels to a worker is the scenario's text, a digest of all that it stands for, and two numbers; what comes back
are rows as they will lie on disk.
"""

import os
import re
import socket
import time
from collections import deque
from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError, RunError, safe
from biped.base.trust import trusting
from biped.ensemble.backend import WAIT
from biped.ensemble.campaign import lost_row, run_one
from biped.ensemble.journal import PLACE, origin_of
from biped.ensemble.parts import About, Chunk, FinishedChunk, encoded
from biped.ensemble.plan import Plan
from biped.ensemble.rows import Row, schema_of, table
from biped.scenario.reading import from_text, to_toml

SECONDS = 10.0
"""[s] that a chunk is meant to take: long beside what it costs to send, short beside what it would cost to lose."""
MOST = 4000
"""Runs of a chunk."""
RECENT = 16
"""Chunks that tell how long a run takes."""


def platform_of(origin: dict[str, str]) -> str:
    """The kind of machine, on which the last bits depend, in words."""
    return ", ".join(origin[name] for name in PLACE)


class Chunks:
    """Makes chunks of a plan, wherever it is sent to: there the plan is made anew from its scenario's text.

    Args:
        plan: The ensemble.
    """

    def __init__(self, plan: Plan):
        self._plan = plan

    @cached_property
    def _origin(self) -> dict[str, str]:
        return origin_of(self._plan)

    def about(self, lost: tuple[int, ...] = ()) -> About:
        """The origin of rows that are computed here."""
        return About({name: value for name, value in self._origin.items() if name not in PLACE}, (self.platform,), lost)

    @property
    def platform(self) -> str:
        """This kind of machine."""
        return platform_of(self._origin)

    def __call__(self, chunk: Chunk) -> FinishedChunk:
        """The rows of a chunk."""
        began = time.perf_counter()
        rows = [run_one(self._plan, index)[1] for index in range(chunk.first, chunk.first + chunk.runs)]
        return self._rows_of(chunk, rows, time.perf_counter() - began)

    def of(self, rows: list[Row]) -> FinishedChunk:
        """Consecutive rows that were made before."""
        lost = tuple(row.index for row in rows if row.lost)
        return self._rows_of(Chunk(rows[0].index, len(rows)), rows, 0.0, lost)

    def lost(self, index: int, error: BaseException) -> FinishedChunk:
        """The row of a run that cost too many workers."""
        return self._rows_of(Chunk(index, 1), [lost_row(self._plan, index, error)], 0.0, (index,))

    def _rows_of(self, chunk: Chunk, rows: list[Row], seconds: float, lost: tuple[int, ...] = ()) -> FinishedChunk:
        data = encoded(table(rows, schema_of(self._plan.scenario)), self.about(lost))
        return FinishedChunk(chunk, data, seconds, f"{socket.gethostname()}/{os.getpid()}", self.platform)

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (to_toml(self._plan.scenario), self._origin["scenario"])


def _again(text: str, digest: str) -> Chunks:
    """The same work where a scenario's text came to."""
    # Whoever sent it trusts the law; who may send anything is the business of the port that it came by.
    with trusting(True):
        chunks = Chunks(Plan(from_text(text, Path("scenario.toml")), checked=True))
    if chunks._origin["scenario"] != digest:
        raise RunError(
            f"{socket.gethostname()}: model, gait or law of this scenario are other files there; expected those of a "
            "user's own on a disk that all machines share"
        )
    return chunks


class Deal:
    """Deals missing runs out in chunks, and halves those that cost workers.

    Args:
        missing: Numbers of the runs to make.
    """

    def __init__(self, missing: Iterable[range]):
        self._left = deque(missing)
        self._again: deque[Chunk] = deque()
        self._recent: deque[tuple[int, float]] = deque(maxlen=RECENT)
        self._total = sum(map(len, self._left))

    def dealt(self, room: int) -> Chunk | None:
        """The next chunk; None if there is none left.

        Args:
            room: Most chunks that are carried out or wait at a time: the last runs are shared among all.
        """
        if self._again:
            return self._again.popleft()
        if not self._left:
            return None
        some = self._left.popleft()
        count = max(1, min(self._count(), -(-self._total // (2 * room)), len(some)))
        if len(some) > count:
            self._left.appendleft(some[count:])
        self._total -= count
        return Chunk(some.start, count)

    def _count(self) -> int:
        """How many runs take `SECONDS`, as far as is known: careful at first, when what takes its time is the start."""
        runs, seconds = sum(count for count, _ in self._recent), sum(took for _, took in self._recent)
        if not runs:
            return 1
        most = 4 * max(count for count, _ in self._recent)
        return int(min(MOST, most, SECONDS * runs / max(seconds, 1e-9)))

    def took(self, made: FinishedChunk) -> None:
        """Takes note of how long a chunk took."""
        self._recent.append((made.chunk.runs, made.seconds))

    def halve(self, chunk: Chunk) -> None:
        """Deals a chunk again, as two."""
        half = chunk.runs // 2
        self._again += [Chunk(chunk.first, half), Chunk(chunk.first + half, chunk.runs - half)]


def run_chunks(chunks: Chunks, missing: Iterable[range], carried_out: Any) -> Iterator[FinishedChunk]:
    """Rows of all chunks, in whatever order; a run that costs too many workers becomes a row that says so.

    Args:
        chunks: The work.
        missing: Numbers of the runs to make.
        carried_out: A map (`biped.ensemble.executor`) of that work.
    """
    deal = Deal(missing)
    out = 0

    def dealt() -> Iterator[Any]:
        nonlocal out
        while True:
            chunk = deal.dealt(carried_out.room)
            if chunk is None and not out:
                return
            out += chunk is not None
            yield WAIT if chunk is None else chunk

    def lost(chunk: Chunk, error: BaseException) -> FinishedChunk | None:
        if chunk.runs == 1:
            return chunks.lost(chunk.first, error)
        deal.halve(chunk)
        return None

    for done in carried_out(dealt(), ordered=False, lost=lost):
        out -= 1
        if done is not None:
            deal.took(done)
            yield done


class Shard(NamedTuple):
    """Share `number` of `of`, counted from 1."""

    number: int
    of: int

    def runs(self, total: int) -> range:
        """Numbers of its runs, of so many: consecutive ones."""
        return range((self.number - 1) * total // self.of, self.number * total // self.of)

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"


def shard_of(text: str) -> Shard:
    """Reads the words after `--shard`.

    Raises:
        InputError: It is no share.
    """
    found = re.fullmatch(r"(\d{1,7})/(\d{1,7})", text, re.ASCII)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(f"--shard {safe(text)}: expected I/N with 1 <= I <= N, such as 3/40")
    return Shard(int(found[1]), int(found[2]))
