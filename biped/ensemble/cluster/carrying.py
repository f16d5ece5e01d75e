"""What runs on a worker: work that was sent there, unpacked once, and its items."""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import Any

from biped.base.trust import trusting
from biped.ensemble.cluster.kinds import platform, versions

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
    """What this worker is."""
    return {"host": socket.gethostname(), "versions": versions(), "platform": platform()}
