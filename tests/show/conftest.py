"""A finished campaign for tests of what people see of one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from biped.cli.main import main
from tests.cases import ENSEMBLE, write


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """Where a campaign of the module's SWEEP lies in ./c, three runs at a point, and what its commands ALSO made."""
    where = tmp_path_factory.mktemp("campaign")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        write("e.toml", ENSEMBLE.replace("runs = 6", "runs = 3") + request.module.SWEEP)
        for argv in (["run", "e.toml", "--out", "c", "--jobs", "1"], *getattr(request.module, "ALSO", ())):
            assert main([*argv]) in (0, 1)
    return where


@pytest.fixture
def result(folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The campaign's result; its folder is the working folder."""
    monkeypatch.chdir(folder)
    return json.loads(Path("c/result.json").read_text(encoding="utf-8"))
