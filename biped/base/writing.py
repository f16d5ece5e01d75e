"""Files that are there whole or not at all: a full disk or a kill leaves what was there before."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from biped.base.errors import InputError


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` to write to; it is on disk and becomes `path` when the block ends well.

    Args:
        path: The file; one that is there is replaced.

    Raises:
        OSError: It cannot be written; nothing of it is left.
    """
    part = part_of(path)
    try:
        yield part
        with open(part, "rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def part_of(path: Path) -> Path:
    """The temporary name of a file that is being written."""
    return path.with_name(f".{path.name}.part")


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
