"""A scheduler that somebody else started."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from biped.ensemble.cluster.connection import CONNECT


def connecting(address: str, tls: Mapping[str, str]) -> Callable[[], Any]:
    """What connects to it.

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
