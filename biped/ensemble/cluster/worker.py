"""`biped worker`: Dask's own worker, set up for walking: one thread, a nanny, kernels loaded, versions told."""

import os
import sys
import threading
from collections.abc import Mapping
from typing import Any

from biped.base.errors import InputError
from biped.base.text import safe
from biped.ensemble.cluster.carrying import resources

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
