"""The folder that a run or campaign leaves behind, written and read; nothing of somebody else's in it is ever removed.

scenario.toml     the effective scenario: running it gives the same results
result.json       verdict, checks, summary and every run's numbers
runs.jsonl        rows as they were finished (a campaign's journal; it resumes from here)
runs.parquet      one row per run, in order, with every metric
parts/            of a large, sharded or distributed campaign: rows as they were finished; of a large one, the rows
trajectory.npz    the trajectory of a single run
traceback.txt     of a single run whose law, the user's own, raised: where
failures/         of a campaign: the last seconds of runs that fell
recording.rrd     for the rerun viewer
figures/          PNG
.lock             while a process is at work in it
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import msgspec

from biped.base.errors import InputError, RunError, why
from biped.base.files import label
from biped.base.typed import convert
from biped.base.writing import written
from biped.ensemble.chunks import Shard
from biped.ensemble.columns import batches, stored_rows
from biped.ensemble.failures import FAILURES, files_of
from biped.ensemble.guard import NAME as LOCK
from biped.ensemble.guard import OF_SEARCHES, Lock, complaining, holds_something_else, numbered, same_runs, unusable
from biped.ensemble.journal import Journal, origin_of
from biped.ensemble.parts import FOLDER as PARTS
from biped.ensemble.parts import FinishedChunk, commit_to
from biped.ensemble.plan import Plan
from biped.measure.metrics.walking import apart
from biped.scenario.metrics import METRICS
from biped.scenario.reading import to_toml


class Folder:
    """A results folder, this process's own until it is closed.

    Args:
        path: Where.
        plan: What is run; its effective scenario identifies the folder.
        runs: Numbers of the runs that are made, where it is not all of the plan's: they have a folder of their own.
        fresh: Whether the folder must not exist yet.
        shard: The share of the campaign that is made: others may be at work in the folder on theirs.
        foreign: Names that say that another command made the folder.

    Attributes:
        path: Where, without `..` and symbolic links: what is tested is what is written to.
        notes: What had to be left out of the journal, in words.
        noted: Whether the journal holds anything; then nothing is discarded.

    Raises:
        FileExistsError: It must not exist, but does.
        InputError: Something else is already there, another process is at work in it, or it cannot be written.
    """

    def __init__(self, path: Path, plan: Plan, runs: Sequence[int] | None = None, fresh: bool = False,
                 shard: Shard | None = None, foreign: frozenset[str] = OF_SEARCHES):  # fmt: skip
        self.notes: list[str] = []
        self._plan = plan
        self._created: set[Path] = set()
        self._made: list[Path] = []
        self._locks: list[Lock] = []
        self.noted = False
        self._kept_before = True
        self._shared = shard is not None
        self.path = path
        text = to_toml(plan.scenario)
        try:
            self.path = Path(os.path.realpath(path))
            if not fresh and holds_something_else(self.path, text, foreign):
                raise InputError(
                    f"--out {path}: already holds something else; expected a new folder, or one with the results of "
                    "exactly this scenario, which are then continued"
                )
            for folder in (*reversed(self.path.parents), self.path):
                self._make(folder, exist_ok=folder != self.path or not fresh)
            self._locks.append(Lock(self.path, path, shared=shard is not None))
            if shard is not None:
                self._locks.append(Lock(self.path, path, name=f"{LOCK}-{shard.number}-of-{shard.of}"))
            self._kept_before = (self.path / FAILURES).exists()
            same_runs(path, self.path, range(len(plan)) if runs is None else runs, runs is None)
            self._asked = path
            there = self.path / "scenario.toml"
            if not there.exists():
                if shard is None:
                    self.save_text(there.name, text)
                else:  # others may do the same at this moment
                    with complaining(there):
                        mine = there.with_name(f".{there.name}.{shard.number}.part")
                        mine.write_text(text, encoding="utf-8")
                        mine.replace(there)
        except FileExistsError as error:
            if fresh and error.filename == str(self.path):
                raise
            raise unusable(path, error) from None
        except RunError as error:
            self.discard()
            raise InputError(f"--out {path}: {error}") from None
        except InputError:
            self.discard()
            raise
        except (OSError, ValueError) as error:
            self.discard()
            raise unusable(path, error) from None

    @classmethod
    def new(cls, root: Path, title: str, plan: Plan, runs: Sequence[int] | None = None) -> Folder:
        """A folder of its own: the first of root/title, root/title-2, … that does not exist."""
        for path in numbered(root, title):
            with suppress(FileExistsError):
                return cls(path, plan, runs, fresh=True)
        raise AssertionError

    def _make(self, folder: Path, exist_ok: bool = True) -> None:
        try:
            folder.mkdir()
        except FileExistsError:
            if not exist_ok or not folder.is_dir():
                raise
        else:
            self._made.append(folder)

    @contextmanager
    def saving(self, name: str) -> Iterator[Path]:
        """A temporary name to write the file `name` to, which is there whole when the block ends, or not at all.

        Raises:
            RunError: It cannot be written.
        """
        path = self.path / name
        with complaining(path), written(path) as part:
            if not path.exists():
                self._created.add(path)
            yield part

    @property
    def journal(self) -> Path:
        """The file of the journal, if there is one."""
        return self.path / "runs.jsonl"

    @cached_property
    def _journal(self) -> Journal:
        return Journal(self.journal, origin_of(self._plan))

    def finished(self) -> list[dict[str, Any]]:
        """Records that an earlier, interrupted command noted; says in `notes` what had to be left out.

        Raises:
            InputError: They are of something else.
            RunError: The journal cannot be read or mended.
        """
        with complaining(self._journal.path):
            records, words = self._journal.read()
        self.notes += words
        self.noted = bool(records)
        return records

    def note(self, record: Mapping[str, Any]) -> dict[str, Any]:
        """Adds a record to the journal and returns it as it will be read; from then on, nothing here is discarded.

        Raises:
            RunError: It cannot be written.
        """
        if not self._journal.path.exists():
            self._created.add(self._journal.path)
        with complaining(self._journal.path):
            read = self._journal.note(record)
        self.noted = True
        return read

    def save_text(self, name: str, text: str) -> None:
        """Writes a text file.

        Raises:
            RunError: It cannot be written.
        """
        with self.saving(name) as part:
            part.write_text(text, encoding="utf-8")

    @cached_property
    def parts(self) -> Path:
        """The folder of rows in files, which is made if need be."""
        path = self.path / PARTS
        with complaining(path):
            self._make(path)
        return path

    def commit(self, made: FinishedChunk) -> None:
        """Puts rows into the folder of parts; from then on, nothing here is discarded.

        Raises:
            RunError: They cannot be written.
        """
        with complaining(self.parts / "rows"):
            commit_to(self.parts, made)
        self.noted = True

    def alone(self) -> bool:
        """Whether no other shard is at work in the folder any more; then it is this process's own."""
        self.close()
        try:
            self._locks = [Lock(self.path, self._asked)]
        except InputError:
            return False
        return True

    def __enter__(self) -> Folder:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Closes; what an error interrupted is discarded, but not what was noted."""
        if kind is None:
            self.close()
        else:
            self.discard()

    def close(self) -> None:
        """Gives the folder free."""
        for lock in reversed(self._locks):
            lock.release()
        self._locks = []

    def discard(self) -> None:
        """Closes, and leaves things as they were before: removes what this process created, and the folders if empty.

        What others put there stays. Once a record is noted, everything stays.
        """
        for path in self._half_written() if self.noted else (*self._created, *self._failures()):
            with suppress(OSError):
                path.unlink()
        self.close()
        if not self._kept_before:
            self._made.append(self.path / FAILURES)
        for folder in () if self.noted else reversed(self._made):
            with suppress(OSError):
                folder.rmdir()  # refuses if anything is in it

    def _failures(self) -> list[Path]:
        """Files of runs that workers of this process kept, none of which were noted."""
        return [] if self._kept_before else files_of(self.path)

    def _half_written(self) -> list[Path]:
        """Files that workers of this process were writing when they were ended; of shards others may be at work."""
        return files_of(self.path, half=True) if len(self._locks) == 1 and not self._shared else []


Number = int | float | None
Count = Annotated[int, msgspec.Meta(ge=0)]
Share = tuple[float, float]


class _Cycle(msgspec.Struct):
    cycle: str
    share: float


class _Run(msgspec.Struct):
    index: Count
    fell: bool
    walked: bool
    end: str
    cause: str
    time: int | float
    distance: Number
    warnings: dict[str, int]
    values: dict[str, Any] = {}
    leg_states: _Cycle | None = None
    per_joint: dict[str, dict[str, Number]] | None = None


class _Check(msgspec.Struct):
    name: str
    value: Number
    expected: str
    passed: bool | None
    why: str = ""


class _Point(msgspec.Struct):
    values: dict[str, Any]
    runs: Count
    walked: Count
    falls: Count
    rate: float
    interval: Share


class _Threshold(msgspec.Struct):
    key: str
    sign: int
    rate: float
    holds_to: Number
    fails_at: Number


class _Summary(msgspec.Struct):
    walked: Count
    falls: Count
    walked_interval: Share
    runs: Count = 0


class _Result(msgspec.Struct):
    """The part of a result that readers rely on; versions may add to it."""

    scenario: str
    engine: str
    passed: bool | None
    summary: _Summary
    thesis: dict[str, int | float]
    checks: list[_Check]
    points: list[_Point] = []
    thresholds: list[_Threshold] = []
    runs: Annotated[list[_Run], msgspec.Meta(min_length=1)] | msgspec.UnsetType = msgspec.UNSET


@contextmanager
def reading(file: Path, what: str, again: str) -> Iterator[None]:
    """Turns whatever is wrong with a file that was written once into one sentence.

    Args:
        file: The file.
        what: What it is expected to be, in words.
        again: The command that makes it anew.

    Raises:
        InputError: The block could not read it, or found something else.
    """
    try:
        yield
    except OSError as error:
        raise InputError(f"{label(file)}: cannot be read: {str(error.strerror).lower()}") from None
    except (ValueError, RecursionError, msgspec.MsgspecError) as error:
        raise InputError(f"{label(file)}: expected {what}: {why(error)}; make it again with: {again}") from None


def result_in(folder: Path) -> dict[str, Any]:
    """The result object in a results folder; metrics that its version did not know yet are None.

    The `runs` of a large campaign, which result.json leaves to files of their own, are
    `biped.ensemble.columns.StoredRows`.

    Raises:
        InputError: It is not there, or not whole.
    """
    file, again = folder / "result.json", folder / "scenario.toml"
    if not again.is_file():
        raise InputError(f"{label(folder)}: expected the scenario.toml of its result beside it, there is none")
    with reading(file, "the whole result of a run", f"biped run {label(again)}"):
        result = json.loads(file.read_bytes())
        read = convert(result, _Result)
        if read.runs is msgspec.UNSET and not read.summary.runs:
            raise ValueError("no runs")
        if ("points" in result) != ("thresholds" in result):
            raise ValueError("points and thresholds: expected both or neither")
        if "points" in result and not (read.points and all(point.values for point in read.points)):
            raise ValueError("points: expected values of what is swept")
        if "runs" in result:
            result["runs"] = [dict(apart(run)) for run in result["runs"]]
        for where in (result["summary"], *result.get("runs", []), *result.get("points", [])):
            _complete(where)
    if "runs" not in result:
        result["runs"] = stored_rows(folder, read.summary.runs)
    return result


def _complete(numbers: dict[str, Any]) -> None:
    for name in METRICS:
        value = numbers.setdefault(name, None)
        if value is not None and not isinstance(value, int | float):
            raise ValueError(f"{name}: expected a number, got {str(value)[:40]!r}")


def of_plan(folder: Path, plan: Plan, result: dict[str, Any]) -> None:
    """Refuses a result that is not one of the scenario beside it.

    Raises:
        InputError: It has runs that the scenario has not.
    """
    last = max(int(columns["index"].max()) for columns in batches(result["runs"], ["index"]))
    if last >= len(plan):
        raise InputError(
            f"{label(folder / 'result.json')}: has a run {last}, but {label(folder / 'scenario.toml')} makes "
            f"{len(plan)}: expected both of the same run; choose another folder"
        )
