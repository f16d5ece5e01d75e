"""Where compiled kernels are kept: a folder of their own for every installation and every version of their sources.

numba's cache looks only at the file of the function that it compiles: a cached tick would go on calling the springs
that it was compiled with after they, or a number that they take in, have changed in another file. So the folder's name
carries a digest of every file of every room that has kernels.
"""

import hashlib
import os
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOMS = ("base", "numerics", "dynamics", "robot", "measure", "control", "engines", "studies/bench")
"""Rooms and folders that have kernels, or numbers that kernels take in."""
_UNUSED = 7 * 24 * 3600.0
"""[s] after which a version that nobody has used is removed: a running process may still add to a younger one."""
_USED = ".used"


def digest(package: Path, more: tuple[str, ...] = ()) -> str:
    """A name for the present state of all sources of kernels below a package.

    Args:
        package: The package.
        more: Rooms that count besides those with kernels.
    """
    state = hashlib.blake2b(digest_size=8)
    for room in (*ROOMS, *more):
        for path in sorted((package / room).rglob("*.py")):
            state.update(str(path.relative_to(package)).encode() + b"\0" + path.read_bytes())
    return state.hexdigest()


@cache
def cache_folder() -> Path:
    """The folder of this installation's kernels in this version; it exists and can be written.

    Beside the package, else in the user's cache, else in a temporary folder of the user's, which stderr is told.
    """
    package = Path(__file__).parents[1]
    name = f"kernels-{digest(package)}"
    own = package / "__pycache__"
    for root in _roots(package):
        folder = root / name
        if _usable(folder):
            break
    else:
        folder = _temporary(package) / name
        folder.mkdir(mode=0o700, exist_ok=True)
        print(f"biped: compiled kernels are kept in {folder}: no other place can be written (NUMBA_CACHE_DIR chooses "
              "one)", file=sys.stderr)  # fmt: skip
    if folder.parent != own and (own / name).is_dir() and not any(folder.glob("*/")):
        shutil.copytree(own / name, folder, dirs_exist_ok=True)  # compiled by whoever may write there
    _sweep(folder)
    return folder


def _roots(package: Path) -> Iterator[Path]:
    yield package / "__pycache__"
    try:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # no home
        return
    if home.is_absolute():
        yield home / "biped" / _place(package)


def _place(package: Path) -> str:
    """A name for an installation."""
    return hashlib.blake2b(str(package.resolve()).encode(), digest_size=8).hexdigest()


def _usable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _temporary(package: Path) -> Path:
    """A temporary folder that only this user can write to: what is loaded from a cache is executed."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"biped-{user}-{_place(package)}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        state = folder.lstat()
    except OSError:
        return Path(tempfile.mkdtemp(prefix="biped-"))
    mine = not hasattr(os, "getuid") or (state.st_uid == user and not state.st_mode & (stat.S_IWGRP | stat.S_IWOTH))
    return folder if stat.S_ISDIR(state.st_mode) and mine else Path(tempfile.mkdtemp(prefix="biped-"))


def _sweep(folder: Path) -> None:
    """Notes that a version is in use, and removes versions of the same installation that have not been for long."""
    mark, now = folder / _USED, time.time()
    try:
        if not mark.exists() or now - mark.stat().st_mtime > _UNUSED / 7.0:
            mark.touch()
            for old in folder.parent.glob("kernels-*"):
                used = old / _USED if (old / _USED).exists() else old
                if old != folder and now - used.stat().st_mtime > _UNUSED:
                    shutil.rmtree(old, ignore_errors=True)
    except OSError:
        pass  # another process swept first
