"""How many tests run side by side where `-n auto` asks for it, as `make test` does."""

from __future__ import annotations

import pytest

from biped.ensemble.campaign import cores

MOST = 8
"""Workers; each takes about 1 GB of memory, and compiles some kernels that another compiles at the same time."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """As many as there are cores; on one core none: tests run in pytest's own process."""
    count = cores()
    return 0 if count == 1 else min(count, MOST)
