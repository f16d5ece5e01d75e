"""Columns that are read in pieces."""

from __future__ import annotations

import numpy as np
import pytest

from biped.ensemble import columns


@pytest.mark.parametrize("held", [1, 7, 1000])
def test_the_number_of_a_rank_in_little_memory(held, monkeypatch):
    monkeypatch.setattr(columns, "HELD", held)
    monkeypatch.setattr(columns, "BINS", 5)
    rng = np.random.default_rng(0)
    for numbers in (rng.normal(size=500), np.round(rng.normal(size=500)), np.full(500, 3.0), np.array([1.0, 1.0, 2.0]),
                    np.array([1.0, np.nextafter(1.0, 2.0)] * 20)):  # fmt: skip
        pieces = np.array_split(numbers, 7)
        for rank in (0, numbers.size // 2, numbers.size - 1):
            assert columns.smallest(lambda pieces=pieces: iter(pieces), rank) == np.sort(numbers)[rank]
