"""numba's cache with a checksum over every file: what is damaged is compiled again, never executed."""

import hashlib
import pickle
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

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
