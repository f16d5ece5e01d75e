"""Work on a worker, and the versions and platform that a worker must have, told as Dask's resources."""

import socket
import sys
from collections.abc import Callable, Mapping
from functools import cache
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path
from typing import Any

from biped.base import VERSION
from biped.base.files import PACKAGE
from biped.base.platform import here
from biped.base.trust import trusting
from biped.ensemble.origin import PLACE


@cache
def versions() -> dict[str, str]:
    """Versions of what results depend on here, and of what client and workers say to each other."""
    return {
        "biped": VERSION,
        "sources": _sources(PACKAGE),
        "python": f"{sys.version_info.major}.{sys.version_info.minor}",
        **{name: value for name, value in here().items() if name not in PLACE},
        "numba": version("numba"),
    }


@cache
def platform() -> dict[str, str]:
    """This kind of machine, which last digits depend on."""
    return {name: value for name, value in here().items() if name in PLACE}


def resources(same: bool = True) -> dict[str, float]:
    """Resources that a worker here offers, and that a client here requires.

    Args:
        same: Whether the kind of machine counts.
    """
    return {_mark("biped", versions()): 1.0} | ({_mark("platform", platform()): 1.0} if same else {})


def words(of: Mapping[str, str]) -> str:
    """Versions or a platform, for people."""
    return ", ".join(f"{name} {value}" for name, value in of.items())


def _mark(name: str, of: Mapping[str, str]) -> str:
    return f"{name}-{blake2b(words(of).encode(), digest_size=8).hexdigest()}"


def _sources(package: Path) -> str:
    state = blake2b(digest_size=6)
    for path in sorted(package.rglob("*.py")):
        state.update(str(path.relative_to(package)).encode() + b"\0" + path.read_bytes())
    return state.hexdigest()


MOST = 4
"""Pieces of work that are kept unpacked."""
_unpacked: dict[str, Callable[[Any], Any]] = {}


def carry_out(key: str, packed: bytes, item: Any) -> Any:
    """Carries one item out.

    Args:
        key: Digest of the work.
        packed: The work, pickled.
        item: What it is called with.
    """
    with trusting(True):  # whoever sent a law named it, or trusts it; who may send is the business of the port
        if key not in _unpacked:
            import cloudpickle

            while len(_unpacked) >= MOST:
                del _unpacked[next(iter(_unpacked))]
            _unpacked[key] = cloudpickle.loads(packed)
        return _unpacked[key](item)


def described() -> dict[str, Any]:
    """A description of this worker: host, versions, platform."""
    return {"host": socket.gethostname(), "versions": versions(), "platform": platform()}
