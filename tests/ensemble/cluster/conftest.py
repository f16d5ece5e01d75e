"""A cluster on this machine."""

from __future__ import annotations

import pytest

from biped.ensemble.cluster import cluster_at


@pytest.fixture(scope="package")
def cluster():
    """Two workers, for all tests here; both have come before the first begins."""
    with cluster_at("local:2", False, lambda words: None) as two:
        two._connection.client.wait_for_workers(2, timeout=120)
        yield two
