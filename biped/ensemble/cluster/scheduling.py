"""A Dask scheduler in a process of its own, for workers on this machine; it goes when standard input ends."""

from __future__ import annotations

import asyncio

from biped.ensemble.cluster.worker import go_with_parent

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
