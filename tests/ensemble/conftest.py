"""Campaigns of six short runs."""

from __future__ import annotations

from contextlib import chdir

import pytest

from biped.studies import run as running
from tests.cases import ENSEMBLE, write
from tests.ensemble.campaigns import run


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of the test's own to work in, with the campaign e.toml."""
    monkeypatch.chdir(tmp_path)
    write("e.toml", ENSEMBLE)


@pytest.fixture
def large(monkeypatch):
    """Six runs are many: their rows lie in files."""
    monkeypatch.setattr(running, "LARGE", 3)


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory):
    """Files of that campaign when one process here ran it from beginning to end."""
    with chdir(tmp_path_factory.mktemp("undisturbed")):
        write("e.toml", ENSEMBLE)
        return run("x", "--jobs", "1")
