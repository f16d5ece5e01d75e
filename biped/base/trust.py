"""Whose Python code may run: the package's, files the user names on the command line, folders of their configuration.

A scenario may come from anybody, and its law is a program with every right of the user. So what a file says is never
enough to run one: the user must have said so, here or in their own configuration.
"""

import os
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.files import PACKAGE, SUFFIX, folder, label, nearest

_GRANTED = "BIPED_TRUST"
"""Variable of the environment with what was granted so far: worker processes inherit it, however they start."""
_EVERY = "*"


@contextmanager
def trusting(everything: bool = False) -> Iterator[None]:
    """Grants hold until the block ends.

    Args:
        everything: Any file may run (`--trust`).
    """
    before = os.environ.get(_GRANTED)
    if everything:
        _add(_EVERY)
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(_GRANTED, None)
        else:
            os.environ[_GRANTED] = before


def grant(file: Path) -> None:
    """Trusts one file, because the user named it."""
    _add(str(file.resolve()))


def _add(word: str) -> None:
    os.environ[_GRANTED] = "\n".join([*_granted(), word])


def _granted() -> list[str]:
    return [word for word in os.environ.get(_GRANTED, "").split("\n") if word]


def trusted(file: Path) -> bool:
    """Whether a file of Python code may run.

    Raises:
        InputError: The user's configuration cannot be read.
    """
    whole = file.resolve()
    granted = _granted()
    if _EVERY in granted or str(whole) in granted:
        return True
    package = [PACKAGE, *(folder(kind) for kind in SUFFIX)]
    return any(whole.is_relative_to(root.resolve()) for root in (*package, *_folders()))


def refusal(file: Path) -> str:
    """The complaint about a file that is not trusted, with a remedy."""
    return (
        f"{label(file)} is Python code from outside the package, which runs only for those who trust it: {remedy(file)}"
    )


def remedy(file: Path) -> str:
    """Returns the words that say how to have a file trusted."""
    return f'give --trust, or put trust = ["{file.resolve().parent}"] into {configuration()}'


def configuration() -> Path:
    """The user's configuration file, which need not exist (XDG base directories)."""
    root = os.environ.get("XDG_CONFIG_HOME", "")
    # A relative one would be a file of whoever made the working folder.
    base = Path(root) if os.path.isabs(root) else Path(os.path.expanduser("~/.config"))
    return base / "biped" / "config.toml"


def _folders() -> list[Path]:
    """Folders whose code the user trusts."""
    path = configuration()
    if not path.is_absolute() or not path.is_file():  # no home, no configuration
        return []
    try:
        data: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read as TOML: {error}") from None
    unknown = [key for key in data if key != "trust"]
    if unknown:
        raise InputError(f"{path}: {unknown[0]}: unknown key; {nearest(unknown[0], ['trust'])}")
    folders = data.get("trust", [])
    if not isinstance(folders, list) or not all(isinstance(one, str) for one in folders):
        raise InputError(f'{path}: trust: expected a list of folders such as ["~/walking"], got {folders!r:.100}')
    paths = [Path(os.path.expanduser(one)) for one in folders]
    for one, at in zip(folders, paths, strict=True):
        if not at.is_absolute():
            raise InputError(f"{path}: trust: expected whole paths (or ~/…), got '{one}'")
    return paths
