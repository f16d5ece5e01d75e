"""Nothing of somebody's is written over: the one guard of all commands that write where a user says."""

import os
import stat
from pathlib import Path
from typing import NamedTuple

from biped.base.errors import InputError

RESULTS = frozenset({"result.json", "runs.jsonl", "parts", "comparison.json", "stability.json", "standard.json",
                     "measured.json", "diff.json"})  # fmt: skip
"""Names by which a folder of results is recognised, one or more for each command that makes such folders."""
_ENDS = 1 << 16  # bytes that are read of both ends of a file


class Kind(NamedTuple):
    """A kind of file that a command writes and may replace.

    Attributes:
        words: The kind in an error.
        suffixes: Endings of its name; none: any.
        marks: Bytes near its beginning or its end, one of which each file of the kind holds.
    """

    words: str
    suffixes: tuple[str, ...]
    marks: tuple[bytes, ...]


def may_write(path: Path, option: str, kind: Kind) -> None:
    """Refuses a file name under which something else is than what an earlier command of the same kind wrote.

    Args:
        path: The file to write. An empty file may be replaced, and so may a link that leads nowhere.
        option: The option that named it, for the error.
        kind: The kind of file that is to be written.

    Raises:
        InputError: Its suffix is of another kind, or something else is there.
    """
    suffixes = " or ".join(f"*{suffix}" for suffix in kind.suffixes)
    if kind.suffixes and path.suffix.lower() not in kind.suffixes:
        raise InputError(f"{option} {path}: expected a file {suffixes}")
    try:
        mode = path.stat().st_mode
        ours = stat.S_ISREG(mode) and _ours(path, kind)
    except (OSError, ValueError):
        return  # nothing is there, or nothing can be: the system's own words come when it is written
    if not ours:
        raise InputError(f"{option} {path}: is there already and is not {kind.words}; nothing is overwritten: expected "
                         "another name")  # fmt: skip


def _ours(path: Path, kind: Kind) -> bool:
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        ends = file.read(_ENDS)
        file.seek(max(0, size - _ENDS))
        ends += file.read(_ENDS)
    return size == 0 or any(mark in ends for mark in kind.marks)


def may_fill(folder: Path, option: str, own: tuple[str, ...]) -> None:
    """Refuses a folder that holds anything but what an earlier command of the same kind left.

    Args:
        folder: The folder to write to.
        option: The option that named it, for the error.
        own: Names by which a command recognises its own folder; one of them must be there unless it is empty or new.

    Raises:
        InputError: Something else is there.
    """
    inside = names_in(folder)
    if inside and (not inside & set(own) or inside & RESULTS - set(own)):
        raise InputError(f"{option} {folder}: already holds something else; expected a new folder, or one that the "
                         "same command wrote")  # fmt: skip


def may_add(folder: Path, option: str) -> None:
    """Refuses a folder of results for figures that do not belong to them.

    Raises:
        InputError: The folder holds results.
    """
    if names_in(folder) & RESULTS:
        raise InputError(f"{option} {folder}: holds results; expected another folder")


def names_in(folder: Path) -> set[str]:
    """Names of what a folder holds; none where there is no folder that can be read."""
    try:
        return set(os.listdir(folder))
    except (OSError, ValueError):
        return set()
