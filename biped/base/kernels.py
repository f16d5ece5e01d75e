"""Where compiled kernels are kept, with checksums, and answers about models beside them.

Every installation and every version of the sources has a folder of its own. numba's cache looks only at the file of
the function that it compiles: a cached tick would go on calling the springs that it was compiled with after they, or a
number that they take in, have changed in another file. So the folder's name carries a digest of every file of every
room that has kernels. What is damaged there is compiled again, never executed.
"""

import hashlib
import os
import pickle
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

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


_SEAL = 32


def sealed(data: bytes) -> bytes:
    """Bytes with their checksum before them."""
    return hashlib.blake2b(data, digest_size=_SEAL).digest() + data


def unsealed(data: bytes) -> bytes | None:
    """The bytes behind a checksum; None if they are not those that were written."""
    return data[_SEAL:] if len(data) > _SEAL and sealed(data[_SEAL:]) == data else None


@cache
def say_damaged(folder: Path) -> None:
    """Says once in a process that compiled code is damaged."""
    print(f"biped: compiled kernels in {folder} are damaged: compiled again", file=sys.stderr)


def cache_file_of(kept: Any) -> Any:
    """The reader and writer of a dispatcher's cache, with a checksum over every file.

    Args:
        kept: numba's own, an `IndexDataCacheFile`.
    """
    from numba.core.caching import IndexDataCacheFile

    class CacheFile(IndexDataCacheFile):
        """See `numba.core.caching.IndexDataCacheFile`."""

        def save(self, key: Any, data: Any) -> None:
            with suppress(OSError):  # a full disk: the code is compiled and runs all the same
                super().save(key, data)

        def _dump(self, obj: Any) -> bytes:
            return sealed(super()._dump(obj))

        def _read(self, path: Path) -> Any:
            try:
                data = path.read_bytes()
            except OSError:
                return None
            whole = unsealed(data)
            if whole is None:
                say_damaged(path.parent)
                return None
            return pickle.loads(whole)

        def _load_index(self) -> dict[Any, str]:
            version, stamp, overloads = self._read(Path(self._index_path)) or (None, None, {})
            return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

        def _save_index(self, overloads: dict[Any, str]) -> None:
            with self._open_for_write(self._index_path) as file:
                file.write(self._dump((self._version, self._source_stamp, overloads)))

        def _load_data(self, name: str) -> Any:
            return self._read(Path(self._data_path(name)))

    return CacheFile(kept._cache_path, kept._index_name.removesuffix(".nbi"), kept._source_stamp)


def agreed(question: bytes, ask: Callable[[], bool]) -> bool:
    """Whether Pinocchio agrees; it is asked once, and again only while it does not.

    Args:
        question: All that the answer hangs on besides Pinocchio itself.
        ask: Asks it.
    """
    asked = hashlib.blake2b(question, digest_size=16)
    library = find_spec("pinocchio")
    if library is not None and library.origin is not None:
        asked.update(f"{library.origin} {Path(library.origin).stat().st_mtime_ns}".encode())
    note = cache_folder() / "agreed" / asked.hexdigest()
    if note.exists():
        return True
    if not ask():
        return False
    with suppress(OSError):  # it is asked again
        note.parent.mkdir(exist_ok=True)
        note.touch()
    return True
