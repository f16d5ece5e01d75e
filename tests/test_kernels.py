"""Compiled kernels are never older than their sources."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from biped.kernels import digest

PACKAGE = Path(__file__).parents[1] / "biped"


def test_digest_changes_with_any_kernel_and_only_with_kernels(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "biped", ignore=shutil.ignore_patterns("__pycache__"))
    copy = tmp_path / "biped"
    assert digest(copy) == digest(PACKAGE)
    seen = {digest(PACKAGE)}
    for name in ("control/springs.py", "control/factor.py", "geometry.py", "trajectory.py"):
        (copy / name).write_text((copy / name).read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
        seen.add(digest(copy))
    assert len(seen) == 5
    (copy / "cli.py").write_text("# changed\n", encoding="utf-8")
    assert digest(copy) in seen


def test_an_edited_callee_is_compiled_again(tmp_path):
    """In a package of two files, caller and callee, the caller's cache must not outlive the callee."""
    package = tmp_path / "biped"
    package.mkdir()
    for name in ("__init__.py", "kernels.py"):
        shutil.copy(PACKAGE / name, package / name)
    (package / "caller.py").write_text(
        "from numba import njit\nfrom biped.callee import f\n\n@njit(cache=True)\ndef g(x):\n    return f(x)\n",
        encoding="utf-8",
    )
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"} | {"PYTHONPATH": str(tmp_path)}
    said = []
    for factor in (2, 3):
        (package / "callee.py").write_text(
            f"from numba import njit\n\n@njit(cache=True)\ndef f(x):\n    return {factor} * x\n", encoding="utf-8"
        )
        for _ in range(2):
            code = "from biped.caller import g; print(g(1.0), sum(g.stats.cache_hits.values()))"
            done = subprocess.run(
                [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
            )
            said.append(done.stdout.split())
    assert said == [["2.0", "0"], ["2.0", "1"], ["3.0", "0"], ["3.0", "1"]]
    assert len(list((package / "__pycache__").glob("kernels-*"))) == 1
