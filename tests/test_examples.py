"""The example scripts and the notebook run as they stand and show something."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))


def _run(script, folder):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, str(script)], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_there_are_ten():
    assert len(SCRIPTS) == 10


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_it_runs(script, tmp_path):
    done = _run(script, tmp_path)
    if "MuJoCo cannot draw here" in done.stderr:
        pytest.skip("nothing can draw here")
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert list(tmp_path.iterdir()) == [], "an example leaves nothing in the working folder"


def test_every_cell_of_the_notebook_runs_in_order(tmp_path, monkeypatch):
    """As a kernel runs them: one after another in one name space, the last expression shown."""
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    notebook = json.loads((ROOT / "examples/walk.ipynb").read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    space: dict[str, object] = {}
    shown = []
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        assert cell["outputs"] == []
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, cell["id"], "exec"), space)
        if last is not None:
            shown.append(eval(compile(ast.Expression(last.value), cell["id"], "eval"), space))
    assert "<table" in shown[0]._repr_html_()
    assert "<table" in shown[-1]._repr_html_()
    assert space["walk"].time[-1] > 2.9
    assert space["many"].runs.num_rows == 4
    assert list(tmp_path.iterdir()) == []
