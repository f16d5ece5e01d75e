"""A connection to a Dask scheduler, which may be lost and found again."""

import logging
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from biped.base.errors import InputError, RunError
from biped.base.progress import Told
from biped.base.text import why

ANSWER = 30.0
"""[s] within which a scheduler answers."""
CONNECT = 10.0
"""[s] that a try to reach it takes."""


class Connection:
    """A connection.

    Args:
        connect: Reaches the scheduler, started anew if that is our business; raises OSError.
        place: What it is called.
        wait: [s] that a scheduler, or a first worker, is waited for; None: for ever.
        remedy: What to do where there are no workers.
        trouble: What is known of workers that do not come.
        mend: Starts workers anew that ended, if that is our business, and says so in words; raises RunError.

    Attributes:
        client: Dask's client.

    Raises:
        InputError: There is no scheduler.
    """

    def __init__(
        self, connect: Callable[[], Any], place: str, wait: float | None, remedy: str,
        trouble: Callable[[], str] = str, mend: Callable[[], str] = str,
    ):  # fmt: skip
        self._connect, self.place, self.wait, self.remedy, self.trouble = connect, place, wait, remedy, trouble
        self.mend = mend
        _hush()
        try:
            self.client = connect()
        except OSError as error:
            raise InputError(f"--cluster {place}: expected a running Dask scheduler: {why(error)}") from None

    def _call(self, call: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
        return self.client.sync(call, *arguments, callback_timeout=ANSWER, **more)

    def workers(self) -> dict[str, dict[str, float]] | None:
        """Resources of every worker by its address; None if the scheduler does not answer."""
        try:
            if self.client.status != "running":
                return None
            found = self._call(self.client.scheduler.identity)["workers"]
        except Exception:  # whatever a broken connection raises
            return None
        return {address: dict(worker["resources"]) for address, worker in found.items()}

    def call(self, function: Callable[[], Any], address: str) -> Any:
        """A worker's answer to a call; an error if it cannot."""
        try:
            return self._call(self.client._run, function, workers=[address], on_error="return")[address]
        except Exception as error:
            return error

    def dashboard(self) -> str:
        """Address of Dask's own page on the cluster, if it has one."""
        try:
            services = self._call(self.client.scheduler.identity)["services"]
            return self.client.dashboard_link if "dashboard" in services else ""
        except Exception:
            return ""

    def again(self, tell: Told) -> None:
        """Finds the scheduler again.

        Raises:
            RunError: It stays away.
        """
        self.close()
        tell(f"{self.place}: the scheduler is gone or does not answer; it is waited for, and finished runs are kept")
        began = time.monotonic()
        while True:
            try:
                self.client = self._connect()
                return
            except OSError:
                if self.wait is not None and time.monotonic() - began > self.wait:
                    break
                time.sleep(1.0)
        raise RunError(
            f"{self.place}: no scheduler for {self.wait:.0f} s; finished runs are kept: start it and its workers, and "
            "the same command with --out goes on from there"
        )

    def close(self) -> None:
        """Lets the scheduler go."""
        with suppress(Exception):
            self.client.close(timeout=2)


def _hush() -> None:
    """Silences the logs of Dask and of what it rests on, also where Dask has set their levels: what matters is said."""
    import distributed  # noqa: F401

    for name in {"distributed", "asyncio", "tornado", *logging.root.manager.loggerDict}:
        if name.partition(".")[0] in ("distributed", "asyncio", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)


def connecting(address: str, tls: Mapping[str, str]) -> Callable[[], Any]:
    """Returns a function that connects to a scheduler at an address.

    Args:
        address: Its address.
        tls: Files `ca_file`, `cert` and `key`; without any, Dask's own configuration says them.
    """

    def connect() -> Any:
        from distributed import Client, Security

        names = {"ca_file": "tls_ca_file", "cert": "tls_client_cert", "key": "tls_client_key"}
        files = {names[name]: path for name, path in tls.items()}
        security = Security(require_encryption=True, **files) if files else None
        return Client(address, timeout=CONNECT, security=security, set_as_default=False)

    return connect
