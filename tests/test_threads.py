"""The Python interface from several threads at once, the first use of biped in a process included."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

KINDS = {
    "planar": 'controller = "normal"\nstart.posture = "heel_toe"',
    "home": 'controller = "normal"\nstart.posture = "heel_toe"\nengine = "home"',
    "spatial": 'model = "human3d"\ncontroller = "human3d"',
    "any": 'model = "walker2d"\nlaw = "stand"',
}
"""Kinds of runs that go different ways through biped."""

MANY = """
import json, sys
from concurrent.futures import ThreadPoolExecutor
import biped

def one(name):
    return biped.run(name, jobs=1).trajectory.q[-1].tolist()

names = sys.argv[2:]
if sys.argv[1] == "threads":
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(one, names))
else:
    found = [one(name) for name in names]
print(json.dumps(found))
"""


def ends(how: str, kinds: list[str], folder: Path) -> list[list[float]]:
    """The last posture of every run, made by a process of its own."""
    for kind, text in KINDS.items():
        (folder / f"{kind}.toml").write_text(f"{text}\nduration = 0.05\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", MANY, how, *(f"{kind}.toml" for kind in kinds)],
        cwd=folder, env=os.environ | {"PYTHONPATH": str(Path(__file__).parent.parent)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[float]]:
    return dict(zip(KINDS, ends("alone", [*KINDS], tmp_path_factory.mktemp("alone")), strict=True))


@pytest.mark.parametrize("attempt", range(3))
def test_runs_in_threads_are_the_runs_without(attempt, alone, tmp_path):
    """Eight at once, in an order of its own each time; types that two threads work out at once end most processes."""
    kinds = ([*KINDS][attempt:] + [*KINDS][:attempt]) * 2
    assert ends("threads", kinds, tmp_path) == [alone[kind] for kind in kinds]
