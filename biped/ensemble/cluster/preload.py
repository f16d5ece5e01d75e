"""What a Dask worker does before it takes work (`--preload biped.ensemble.cluster.preload`).

It imports what runs need, so that kernels are loaded, or compiled once a host, and it says what it is.
"""

from __future__ import annotations

from typing import Any

from biped.ensemble.cluster.kinds import resources


def dask_setup(worker: Any) -> None:
    """Called by Dask, before the worker tells the scheduler of itself."""
    from biped.engines import mujoco  # noqa: F401
    from biped.measure import metrics  # noqa: F401

    for name, amount in resources().items():
        worker.state.total_resources[name] = amount
        worker.state.available_resources[name] = amount
