"""Compiled kernels are never older than their sources."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from biped.base.kernels import digest

PACKAGE = Path(__file__).parents[2] / "biped"


def test_digest_changes_with_any_kernel_and_only_with_kernels(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "biped", ignore=shutil.ignore_patterns("__pycache__"))
    copy = tmp_path / "biped"
    assert digest(copy) == digest(PACKAGE)
    seen = {digest(PACKAGE)}
    for name in ("control/springs.py", "numerics/factor.py", "robot/tree.py", "measure/trajectory.py"):
        (copy / name).write_text((copy / name).read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
        seen.add(digest(copy))
    assert len(seen) == 5
    (copy / "cli" / "main.py").write_text("# changed\n", encoding="utf-8")
    assert digest(copy) in seen


def test_an_edited_callee_is_compiled_again(tmp_path):
    """In a package of two files, caller and callee, the caller's cache must not outlive the callee."""
    package = tmp_path / "biped"
    (package / "base").mkdir(parents=True)
    for name in ("__init__.py", "base/__init__.py", "base/kernels.py"):
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


WALKS = """
import sys
import numpy as np
from biped.ensemble import campaign
from biped.studies.run import plan_of

SHORT = ["duration=0.3", "window.start=0.1", "window.end=0.3", "start.jitter=0.002"]
CASES = {
    "joint": [],
    "touching": ["actuation.contacts=touching", "actuation.single_tangential=true"],
    "generalized": ["actuation.mode=generalized"],
    "model error": ["randomise.controller_mass_matrix=0.1", "randomise.controller_constraints=0.1"],
    "bounded": ["actuation.limit=bounded", "actuation.torque_limit=40.0"],
    "pyramid": ["simulation.cone=pyramidal", "ground.slope=3"],
    "home": ["engine=home"],
    "home, dropped": ["engine=home", "start.settle=false", "actuation.mode=generalized"],
}
logs = {}
for name, changes in CASES.items():
    t = campaign.simulate(plan_of("level_normal", [*SHORT, *changes]).run(0))
    assert len(t) == 300, (name, t.cause)
    logs[name] = t.log
np.savez(sys.argv[1], **logs)
"""


def test_compiled_kernels_do_what_they_do_as_plain_python(tmp_path):
    """Control tick, rigid engine and geometry, 300 ticks of each kind of run.

    Measured: equal to the last bit. A rounding error of one tick grows by an order of magnitude or two in 0.3 s.
    """
    import numpy as np

    logs = []
    for disable in "01":
        file = tmp_path / f"{disable}.npz"
        environment = os.environ | {"NUMBA_DISABLE_JIT": disable, "PYTHONPATH": str(PACKAGE.parent)}
        subprocess.run([sys.executable, "-c", WALKS, str(file)], env=environment, cwd=tmp_path, check=True)
        logs.append(dict(np.load(file)))
    assert len(logs[0]) == 8
    for name, log in logs[0].items():
        scale = np.abs(log).max(axis=0) + 1.0
        assert np.abs((logs[1][name] - log) / scale).max() < 1e-10, name
