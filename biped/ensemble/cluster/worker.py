"""`biped worker`: Dask's own worker, set up for walking: one thread, a nanny, kernels loaded.

Its versions and its platform, which must be those that work needs, are told as Dask's resources.
"""

import os
import socket
import sys
import threading
from collections.abc import Callable, Mapping
from functools import cache
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path
from typing import Any

from biped.base import VERSION
from biped.base.errors import InputError, safe
from biped.base.files import PACKAGE
from biped.base.trust import trusting
from biped.ensemble.journal import PLACE, here

PRELOAD = "biped.ensemble.cluster.worker"
QUIET = {"distributed.worker.profile.enabled": False}
"""Settings of a worker whose threads have better to do than to be asked every 10 ms where they are."""
PATIENCE = 60
"""[s] after which a worker goes that finds no scheduler."""


def needed() -> None:
    """Makes sure that Dask is there.

    Raises:
        InputError: It is not.
    """
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError(
            "needs the package 'distributed'; install it with: pip install distributed dask-jobqueue cryptography"
        ) from None


def go_with_parent() -> None:
    """Ends this process when standard input does: whoever started it holds the other end, however that ends."""

    def wait() -> None:
        while sys.stdin.buffer.read(4096):
            pass
        os._exit(0)

    threading.Thread(target=wait, daemon=True).start()


def options(lifetime: str | None = None) -> list[str]:
    """Arguments of Dask's worker, wherever it is started.

    Args:
        lifetime: After which it goes, having handed over what it has.
    """
    ends = [] if lifetime is None else ["--lifetime", lifetime, "--lifetime-stagger", "30s"]
    return ["--preload", PRELOAD, "--no-dashboard", *ends]


def work(scheduler: str, workers: int, memory: str, lifetime: str | None, tls: Mapping[str, str]) -> None:
    """Works for a scheduler until that is gone.

    Args:
        scheduler: Its address.
        workers: How many work.
        memory: Most memory of each.
        lifetime: When they go by themselves.
        tls: Files `ca-file`, `cert` and `key` of a scheduler at tls://….

    Raises:
        InputError: It cannot be an address.
    """
    needed()
    if not scheduler.startswith(("tcp://", "tls://")) or not scheduler.rpartition(":")[2].isdigit():
        raise InputError(f"worker: {safe(scheduler)}: expected the address of a scheduler, such as tcp://host:8786")
    if workers < 1:
        raise InputError(f"--workers {workers}: expected at least 1")
    import dask.config
    from distributed.cli.dask_worker import main

    dask.config.set(QUIET)
    argv = [scheduler, "--nanny", "--nthreads", "1", "--nworkers", str(workers), "--memory-limit", memory]
    argv += ["--death-timeout", str(PATIENCE), *options(lifetime)]
    for name, path in tls.items():
        argv += [f"--tls-{name}", path]
    main(argv, standalone_mode=False)


def dask_setup(worker: Any) -> None:
    """Called by Dask, before the worker tells the scheduler of itself."""
    from biped.engines import mujoco  # noqa: F401
    from biped.measure import metrics  # noqa: F401

    for name, amount in resources().items():
        worker.state.total_resources[name] = amount
        worker.state.available_resources[name] = amount


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
