"""How tests run side by side where `-n auto` asks for it, as `make test` does."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.ensemble.campaign import cores

MOST = 8
"""Workers; each takes about 1 GB of memory."""
APART = ("dynamics", "numerics", "scenario")
"""Rooms whose tests compile nothing of the walking loop."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """As many as there are cores; on one core none: tests run in pytest's own process."""
    count = cores()
    return 0 if count == 1 else min(count, MOST)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Lets the second worker begin with tests of `APART`.

    Workers begin one after another in the list. Where nothing is compiled yet, two that begin with walks compile the
    same kernels at the same time, which takes a minute and a half of both; so one of them does, and the other's walks
    find them made.
    """
    workers = getattr(config, "workerinput", {}).get("workercount", 1)
    if workers > 1:
        here = Path(__file__).parent
        room = [item.path.relative_to(here).parts[0] for item in items]
        apart = [item for item, name in zip(items, room, strict=True) if name in APART]
        rest = [item for item, name in zip(items, room, strict=True) if name not in APART]
        begins = len(items) // workers
        items[:] = rest[:begins] + apart + rest[begins:]
