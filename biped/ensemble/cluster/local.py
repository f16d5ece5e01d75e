"""A scheduler and workers on this machine, as processes that end with this one, however it ends."""

import asyncio
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from biped.base.errors import RunError
from biped.ensemble.cluster.tasks import CONNECT
from biped.ensemble.cluster.worker import go_with_parent

START = 60.0
"""[s] that a scheduler takes at most to start."""
LIVES = 3
"""Times that workers are started anew."""


class Local:
    """A cluster of this machine; nobody else can reach it.

    Args:
        workers: How many.
    """

    def __init__(self, workers: int):
        self._workers = workers
        self._processes: list[subprocess.Popen[bytes]] = []
        self._folder = tempfile.TemporaryDirectory(prefix="biped-cluster-")
        self._log = Path(self._folder.name) / "log"
        self._address, self._ended = "", 0
        self._working: subprocess.Popen[bytes] | None = None

    def connect(self) -> Any:
        """Starts it, anew if it ran before, and connects.

        Raises:
            OSError: It does not start.
        """
        from distributed import Client

        self.stop()
        scheduler = self._start("biped.ensemble.cluster.local")
        address = _first_line(scheduler)
        if not address:
            raise OSError(f"no scheduler could be started: {self.last_words()}")
        self._address = address
        self._working = self._start_workers()
        return Client(address, timeout=CONNECT, set_as_default=False)

    def _start_workers(self) -> subprocess.Popen[bytes]:
        argv = ("worker", self._address, "--workers", str(self._workers), "--with-parent")
        return self._start("biped.cli.main", *argv)

    def mend(self) -> str:
        """Starts the workers anew if their process ended, and says so; says nothing while it lives.

        Raises:
            RunError: They ended too often.
        """
        if self._working is None or self._working.poll() is None:
            return ""
        self._ended += 1
        if self._ended > LIVES:
            raise RunError(f"the workers of local:{self._workers} ended {self._ended} times{self.trouble()}; finished "
                           "runs are kept, and the same command with --out goes on from there")  # fmt: skip
        self._working = self._start_workers()
        return f"local:{self._workers}: its workers ended, and are started anew; finished runs are kept"

    def _start(self, module: str, *more: str) -> subprocess.Popen[bytes]:
        # Files that Dask writes besides go to a folder that ends with this process; no Ctrl-C reaches them.
        settings = {"DASK_TEMPORARY_DIRECTORY": self._folder.name, "DASK_DISTRIBUTED__ADMIN__EVENT_LOOP_MONITOR": "0"}
        root = str(Path(__file__).parents[3])
        path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
        with open(self._log, "ab") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", module, *more], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log,
                env=os.environ | settings | {"PYTHONPATH": path}, start_new_session=True,
            )  # fmt: skip
        self._processes.append(process)
        return process

    def last_words(self) -> str:
        """The last words that the processes printed."""
        lines = self._log.read_text(encoding="utf-8", errors="replace").splitlines() if self._log.exists() else []
        return next((line for line in reversed(lines) if line.strip()), "")[:300]

    def trouble(self) -> str:
        """An explanation why workers do not come, as far as it is known."""
        last = self.last_words()
        return f" (their last words: {last})" if last else ""

    def stop(self) -> None:
        """Ends its processes."""
        processes, self._processes = self._processes, []
        for process in processes:
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    pipe.close()
        for process in processes:
            try:
                process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def close(self) -> None:
        """Ends it."""
        self.stop()
        self._folder.cleanup()


def _first_line(process: subprocess.Popen[bytes]) -> str:
    """The first line that a process says within `START`; nothing if it ends before."""
    import selectors

    assert process.stdout is not None
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        return process.stdout.readline().decode().strip() if selector.select(START) else ""


ATTEMPTS = 3
"""Workers that a piece of work may cost."""


async def _serve() -> None:
    import dask.config
    from distributed import Scheduler

    settings = {
        "distributed.scheduler.allowed-failures": ATTEMPTS - 1,
        "distributed.scheduler.worker-ttl": "60s",
        "distributed.admin.event-loop-monitor": False,
    }
    with dask.config.set(settings):
        scheduler = await Scheduler(host="127.0.0.1", port=0, dashboard_address="127.0.0.1:0")
        print(scheduler.address, flush=True)
        await scheduler.finished()


if __name__ == "__main__":
    go_with_parent()
    asyncio.run(_serve())
