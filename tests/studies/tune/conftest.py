"""A small search."""

from __future__ import annotations

import pytest

from tests.studies.tune.small import TEXT


@pytest.fixture
def scenario_file(tmp_path):
    """Its file."""
    path = tmp_path / "small.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path
