"""Files that are there whole or not at all, and that replace nothing of somebody's; results as JSON."""

import json
import math
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError


@contextmanager
def written(path: Path, mark: str = "") -> Iterator[Path]:
    """A temporary name beside `path` to write to; it is on disk and becomes `path` when the block ends well.

    Args:
        path: The file; one that is there is replaced.
        mark: Makes the temporary name the caller's own, where several may write the same file at once. Without one,
            what a killed process left is written over by whoever does its work again.

    Raises:
        OSError: It cannot be written; nothing of it is left.
    """
    part = path.with_name(f".{path.name}{mark}.part")
    try:
        yield part
        with open(part, "rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes a text file in UTF-8, whole or not at all.

    Raises:
        OSError: It cannot be written.
    """
    with written(path) as part:
        part.write_text(text, encoding="utf-8")


def write_into(folder: Path, texts: Mapping[str, str]) -> None:
    """Writes text files into a folder, which is made if it does not exist; each is there whole or not at all.

    Args:
        folder: Where; what it was asked for as is said as --out.
        texts: By name.

    Raises:
        InputError: They cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            write_text(folder / name, text)
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be written: {reason(error)}; choose another folder") from None


def reason(error: Exception) -> str:
    """Why the system refused, in words."""
    number = getattr(error, "errno", None)  # libraries put words of their own around the system's
    return (os.strerror(number) if number else str(error)).lower()


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


def dumps(value: Any, indent: int | None = None) -> str:
    """JSON of a result; a number that does not exist is null."""
    return json.dumps(_without_nan(value), indent=indent, ensure_ascii=False, allow_nan=False)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def with_nan(record: dict[str, Any]) -> dict[str, Any]:
    """A record that was read, null being a number that does not exist."""
    return {key: math.nan if inner is None else inner for key, inner in record.items()}
