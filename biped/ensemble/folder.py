"""The folder that a run or campaign leaves behind; nothing in it that is not this process's own is ever removed.

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
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any

from biped.base.errors import InputError, RunError
from biped.base.files import label
from biped.base.writing import reason, write_text, written
from biped.ensemble import packed
from biped.ensemble.journal import Journal
from biped.ensemble.lock import NAME as LOCK
from biped.ensemble.lock import Lock
from biped.ensemble.origin import origin_of
from biped.ensemble.parts import FOLDER as PARTS
from biped.ensemble.parts import Made, commit_to
from biped.ensemble.plan import Plan
from biped.ensemble.shard import Shard
from biped.scenario.reading import to_toml

FAILURES = "failures"
_KEPT = re.compile(r"run-\d{5,}\.(xz|txt)|\.run-\d{5,}\.(xz|txt)\.part")
_HALF = re.compile(r"\.run-\d{5,}\.(xz|txt)\.part")
LONGEST = 100
"""[bytes] of a title in the name of a folder."""


class Folder:
    """A results folder, this process's own until it is closed.

    Args:
        path: Where.
        plan: What is run; its effective scenario identifies the folder.
        runs: Numbers of the runs that are made, where it is not all of the plan's: they have a folder of their own.
        fresh: Whether the folder must not exist yet.
        shard: The share of the campaign that is made: others may be at work in the folder on theirs.

    Attributes:
        path: Where, without `..` and symbolic links: what is tested is what is written to.
        notes: What had to be left out of the journal, in words.
        noted: Whether the journal holds anything; then nothing is discarded.

    Raises:
        FileExistsError: It must not exist, but does.
        InputError: Something else is already there, another process is at work in it, or it cannot be written.
    """

    def __init__(self, path: Path, plan: Plan, runs: Sequence[int] | None = None, fresh: bool = False,
                 shard: Shard | None = None):  # fmt: skip
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
            if not fresh and _holds_something_else(self.path, text):
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
            _same_runs(path, self.path, range(len(plan)) if runs is None else runs, runs is None)
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
            raise _unusable(path, error) from None
        except RunError as error:
            self.discard()
            raise InputError(f"--out {path}: {error}") from None
        except InputError:
            self.discard()
            raise
        except (OSError, ValueError) as error:
            self.discard()
            raise _unusable(path, error) from None

    @classmethod
    def new(cls, root: Path, title: str, plan: Plan, runs: Sequence[int] | None = None) -> Folder:
        """A folder of its own: the first of root/title, root/title-2, … that does not exist."""
        for path in _numbered(root, title):
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

    def commit(self, made: Made) -> None:
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
        for path in self._half_kept() if self.noted else (*self._created, *self._kept_now()):
            with suppress(OSError):
                path.unlink()
        self.close()
        if not self._kept_before:
            self._made.append(self.path / FAILURES)
        for folder in () if self.noted else reversed(self._made):
            with suppress(OSError):
                folder.rmdir()  # refuses if anything is in it

    def _kept_now(self) -> list[Path]:
        """Files of runs that workers of this process kept, none of which were noted."""
        if self._kept_before or not (self.path / FAILURES).is_dir():
            return []
        return [path for path in (self.path / FAILURES).iterdir() if _KEPT.fullmatch(path.name)]

    def _half_kept(self) -> list[Path]:
        """What workers of this process were writing when they were ended; of shards others may be at work."""
        if len(self._locks) != 1 or self._shared or not (self.path / FAILURES).is_dir():
            return []
        return [path for path in (self.path / FAILURES).iterdir() if _HALF.fullmatch(path.name)]


def keep(
    folder: Path, number: int, cause: str, save: Callable[[Path], None], more: str = "", traceback: str = ""
) -> None:
    """Keeps a trajectory of run `number` of a results folder, wherever it was made, and how to see it again.

    Args:
        folder: The results folder.
        number: Of the run.
        cause: How it ended.
        save: Writes the trajectory to a file.
        more: Arguments that the command needs besides.
        traceback: Of a law of the user's own that raised.

    Raises:
        RunError: It cannot be written.
    """
    kept = folder / FAILURES
    again = f"biped run {shlex.quote(label(folder / 'scenario.toml'))} --only {number}{more}"
    with complaining(kept):
        kept.mkdir(exist_ok=True)
        with written(kept / f"run-{number:05d}{packed.SUFFIX}") as part:
            save(part)
        write_text(kept / f"run-{number:05d}.txt", f"{cause}\nagain: {again}\n{traceback}")


def _holds_something_else(path: Path, text: str) -> bool:
    """Whether a folder has anything in it but the results of the scenario with this text."""
    if not path.exists():
        return False
    there = path / "scenario.toml"
    if not path.is_dir():
        return True
    if there.is_file():
        return there.read_bytes() != text.encode()
    # A command that was killed before it wrote anything may have left these.
    return any(not inside.name.startswith((LOCK, f".{there.name}.")) for inside in path.iterdir())


def _same_runs(asked: Path, path: Path, runs: Sequence[int], whole: bool) -> None:
    """Refuses to lay results of some runs of a scenario over those of others."""
    try:
        there = [run["index"] for run in json.loads((path / "result.json").read_bytes())["runs"]]
    except (OSError, ValueError, TypeError, KeyError):
        there = list(runs)
    if there != list(runs) or (not whole and any((path / name).exists() for name in ("runs.jsonl", PARTS))):
        raise InputError(f"--out {asked}: already holds other runs of this scenario; choose another folder")


def _unusable(path: Path, error: Exception) -> InputError:
    return InputError(f"--out {path}: cannot be written: {reason(error)}; choose another folder")


@contextmanager
def complaining(path: Path) -> Iterator[None]:
    """Turns a refusal of the system to write a file into one paragraph.

    Raises:
        RunError: The block raised an OSError.
    """
    try:
        yield
    except OSError as error:
        try:
            name = label(path)
        except OSError:  # the working folder is gone
            name = str(path)
        raise RunError(
            f"{name}: cannot be written: {reason(error)}; finished runs are kept: once it can, the same command "
            "with --out goes on from there"
        ) from error


def new_folder(root: Path, title: str) -> Path:
    """The first of root/title, root/title-2, … that does not exist."""
    return next(path for path in _numbered(root, title) if not path.exists())


def _numbered(root: Path, title: str) -> Iterator[Path]:
    name = slug(title)
    yield root / name
    for number in count(2):
        yield root / f"{name}-{number}"


def slug(title: str) -> str:
    """A title as the name of one folder: no separators, no leading dots, not too long, never empty."""
    name = re.sub(r"[^\w.-]+", "-", title).strip("-.")
    return name.encode()[:LONGEST].decode(errors="ignore") or "scenario"
