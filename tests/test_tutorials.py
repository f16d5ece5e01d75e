"""Tutorials can be followed: their files are written and their commands typed, in order; laws of pages run."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import biped
from biped.cli.main import main
from biped.studies.policy.tape import read_tape

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
TUTORIALS = ("first-run.md", "your-robot.md", "compare-controllers.md", "ci.md")
FAILS = {
    "first-run.md": ["harder", "many"],
    "your-robot.md": ["law=my_law.py:Law", "sweep"],
    "compare-controllers.md": ["diff"],
    "ci.md": ["diff"],
}
"""Words of commands that may end with exit code 1 or 3, as their pages say."""
SHORT: dict[str, Any] = {"duration": 0.3, "window.start": 0.1, "window.end": 0.3}
ANY = 'model = "h1"\nlaw = "stand"\nduration = 0.3\nwindow = { start = 0.1, end = 0.3 }\n'
_BLOCK = re.compile(r"```(\w+)\n(.*?)```", re.DOTALL)
_NAMED = re.compile(r"`([\w/]+\.(?:toml|py))`[^`]*\Z")


def steps(page: str) -> list[tuple[str, str, str]]:
    """The blocks of a page in their order: language, text, and the file that the words before it name."""
    text, found = (DOCS / page).read_text(encoding="utf-8"), []
    for block in _BLOCK.finditer(text):
        name = _NAMED.search(text[: block.start()].rsplit("\n\n", 2)[-2])
        found.append((block[1], block[2], name[1] if name else ""))
    return found


def write(name: str, text: str) -> None:
    """Writes a file of a tutorial into the working folder."""
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_text(text, encoding="utf-8")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS)
def test_a_tutorial_can_be_followed(page):
    typed = 0
    shutil.copytree(ROOT / "models", "models")  # as a clone has them
    for language, text, name in steps(page):
        if name and language in ("toml", "python"):
            write(name, text)
        for line in text.splitlines() if language == "sh" else ():
            words = shlex.split(line, comments=True)
            if not words or words[0] != "biped" or words[1] in ("view", "new"):
                continue
            allowed = (0, 1, 3) if any(word in line for word in FAILS.get(page, [])) else (0,)
            assert main(words[1:]) in allowed, line
            typed += 1
    assert typed >= 3


def test_the_law_of_the_robots_tutorial_runs():
    (law,) = [text for language, text, _ in steps("your-robot.md") if language == "python"]
    write("my_law.py", law)
    write("short.toml", ANY)
    result = biped.run("short.toml", law="my_law.py:Law")
    assert result.trajectory.time[-1] == pytest.approx(0.3, abs=2e-3)


def test_the_laws_of_the_page_of_controllers_run():
    seven, other, policy = [text for language, text, _ in steps("controllers.md") if language == "python"]
    write("pd.py", seven)
    write("other.py", other)
    write("short.toml", ANY)
    result = biped.run("level_normal", law="pd.py:Law", **SHORT)
    assert result.trajectory.signals["error"].max() > 0.0
    result = biped.run("short.toml", law="other.py:Law")
    assert result.trajectory.time[-1] == pytest.approx(0.3, abs=2e-3)
    space: dict = {}
    exec(compile(policy, "walker.py", "exec"), space)
    assert len(space["Walker"].observations) == 5


def test_a_trainers_loop_writes_a_tape_that_is_read():
    (text,) = [text for language, text, _ in steps("your-policy.md") if language == "python"]
    before, within, after = text.split("\n\n")
    space: dict[str, Any] = {"np": np, "data": SimpleNamespace(time=0.5, qpos=np.ones(9), qvel=np.zeros(8))}
    space |= {name: np.zeros(3) for name in ("command", "observation", "action", "target", "target_before")}
    for part in (before, within, within, after):
        exec(part, space)
    tape = read_tape(Path("tape.npz"))
    assert tape.qpos.shape == (2, 9)
    assert tape.time.tolist() == [0.5, 0.5]


@pytest.mark.parametrize("module", ["pyarrow", "duckdb", "polars"])
def test_rows_of_a_large_campaign_are_read_as_the_page_of_clusters_says(module):
    pytest.importorskip(module)
    import pyarrow
    import pyarrow.parquet

    Path("map/parts").mkdir(parents=True)
    columns = {"index": [0, 1], "speed": [0.5, 0.7], "walked": [True, False], "fell": [False, True],
               "values.push.0.force.0": [50.0, 50.0], "values.push.0.at": [5.0, 5.2]}  # fmt: skip
    pyarrow.parquet.write_table(pyarrow.table(columns), "map/parts/0.parquet")
    (block,) = [text for language, text, _ in steps("clusters.md") if language == "python" and module in text]
    *before, last = block.strip().split("\n\n")
    space: dict = {}
    exec("\n".join(before), space)
    assert len(eval(last, space)) == 1


def test_every_page_with_python_has_a_test():
    pages = {page.name for page in DOCS.glob("*.md") if "```python" in page.read_text(encoding="utf-8")}
    assert pages == {"python.md", "dynamics.md", "controllers.md", "your-robot.md", "clusters.md", "your-policy.md"}
