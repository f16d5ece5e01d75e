"""The guard of a results folder: its name, the lock of whoever works in it, and when it is refused."""

import errno
import json
import os
import re
import socket
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from biped.base.errors import InputError, RunError
from biped.base.files import label
from biped.base.writing import RESULTS, reason
from biped.ensemble.parts import FOLDER as PARTS

NAME = ".lock"
_UNSUPPORTED = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


class Lock:
    """A folder's lock, held from here to `release` or to the end of the process, however it ends.

    No clock and no process number decides: a lock file that a killed process left is simply taken over. Workers do not
    inherit it. Where a file system knows no locks, there is none.

    Args:
        folder: The folder.
        asked: What the user called it, for the error.
        shared: Whether others that say so may hold it too: shards of one campaign.
        name: Of the file; two locks of different names do not know each other.

    Raises:
        InputError: Another process is at work in it.
        OSError: The folder cannot be written to.
    """

    def __init__(self, folder: Path, asked: Path, shared: bool = False, name: str = NAME):
        import fcntl

        self._path = folder / name
        self._shared = shared
        while True:
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            try:
                fcntl.lockf(self._file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno in _UNSUPPORTED:
                    return
                who = os.read(self._file, 200).decode(errors="replace").strip()
                os.close(self._file)
                if error.errno not in (errno.EACCES, errno.EAGAIN):
                    raise
                raise InputError(
                    f"--out {asked}: another command is at work in it{f' ({who})' if who else ''}; wait for it, or "
                    "choose another folder"
                ) from None
            if self._is_there():
                break
            os.close(self._file)  # whoever had it removed it in between
        if shared:
            return
        with suppress(OSError):  # words for people; the lock is the system's
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)

    def _is_there(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file), os.stat(self._path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Gives the folder free and removes the lock file, unless others hold it too."""
        import fcntl

        if self._file < 0:
            return
        with suppress(OSError):
            if self._shared:
                fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._path.unlink()
        os.close(self._file)
        self._file = -1


def unusable(path: Path, error: Exception) -> InputError:
    """The error for a folder that nothing can be written to."""
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


_STUDIED = RESULTS - {"result.json", "runs.jsonl", PARTS}
OF_RUNS = _STUDIED | {"trajectory.npz", "runs.parquet", PARTS}
"""Names that are in no folder of a search."""
OF_SEARCHES = _STUDIED | {"gait.toml", "convergence.png", "least.png"}
"""Names that are in no folder of runs."""


def _mode(path: Path) -> int:
    """The kind of file that a path is (`stat.S_IFMT`); 0 if it is gone."""
    try:
        return path.stat().st_mode
    except OSError:
        return 0


def holds_something_else(path: Path, text: str, foreign: frozenset[str] = frozenset()) -> bool:
    """Whether a folder has anything in it but the results of the scenario with this text.

    Args:
        path: The folder.
        text: The scenario.
        foreign: Names that say that another command made the folder, of the same scenario perhaps.
    """
    if not path.exists():
        return False
    there = path / "scenario.toml"
    if not path.is_dir():
        return True
    ones = list(path.iterdir())  # once: another command may begin at this moment
    inside = {one.name for one in ones}
    if any(stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode) or stat.S_ISCHR(mode) or stat.S_ISBLK(mode)
           for mode in map(_mode, ones)):  # fmt: skip
        return True  # whoever opens one of these may wait for ever
    if inside & foreign:
        return True
    if there.name in inside:
        return not there.is_file() or there.read_bytes() != text.encode()
    # A command that was killed before it wrote anything may have left these.
    return any(not name.startswith((NAME, f".{there.name}.")) for name in inside)


def same_runs(asked: Path, path: Path, runs: Sequence[int], whole: bool) -> None:
    """Refuses to lay results of some runs of a scenario over those of others.

    Args:
        asked: The folder as it was asked for.
        path: Where it is.
        runs: Numbers of the runs.
        whole: Whether they are all of the scenario's.

    Raises:
        InputError: Others are there.
    """
    try:
        there = [run["index"] for run in json.loads((path / "result.json").read_bytes())["runs"]]
    except (OSError, ValueError, TypeError, KeyError):
        there = list(runs)
    if there != list(runs) or (not whole and any((path / name).exists() for name in ("runs.jsonl", PARTS))):
        raise InputError(f"--out {asked}: already holds other runs of this scenario; choose another folder")


LONGEST = 100
"""[bytes] of a title in the name of a folder."""


def new_folder(root: Path, title: str) -> Path:
    """The first of root/title, root/title-2, … that does not exist."""
    return next(path for path in numbered(root, title) if not path.exists())


def numbered(root: Path, title: str) -> Iterator[Path]:
    """Yields root/title, root/title-2 and so on."""
    name = slug(title)
    yield root / name
    for number in count(2):
        yield root / f"{name}-{number}"


def slug(title: str) -> str:
    """A title as the name of one folder: no separators, no leading dots, not too long, never empty."""
    name = re.sub(r"[^\w.-]+", "-", title).strip("-.")
    return name.encode()[:LONGEST].decode(errors="ignore") or "scenario"
