"""One process at a time in a results folder: the system's own lock, which ends with whoever holds it."""

from __future__ import annotations

import errno
import os
import socket
from contextlib import suppress
from pathlib import Path

from biped.base.errors import InputError

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
