"""biped from Python: the page that explains it runs as printed, and what comes back is what commands write."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import rerun
import rerun.notebook

import biped
from biped.base.errors import InputError
from biped.cli.main import main
from biped.scenario.vary import setting
from biped.show import viewer
from tests.cases import contents

ROOT = Path(__file__).parents[1]
SHORT = {"duration": 0.3, "window.start": 0.1, "window.end": 0.3}
CHANGES = ["duration=0.3", "window.start=0.1", "window.end=0.3"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_the_page_runs_as_printed():
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) == 8
    names: dict = {"__name__": "notebook"}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)
    assert repr(names["result"]) == re.search(r"# (<level_slow.*>)", text)[1]
    assert np.array_equal(names["again"].time, names["ensemble"].replay(0).time)
    assert [point["values"]["ground.slope"] for point in names["swept"].points] == [-1, 0, 1]
    assert len(names["table"]) == 4
    assert {"home", "mujoco", "spread"} <= set(names["both"].metrics.column_names)
    assert names["standing"].trajectory.end == "completed"
    assert Path("slow/recording.rrd").stat().st_size > 10_000


def test_results_show_themselves_in_a_notebook_and_names_stay_words():
    result = biped.run("level_normal", description="<b>bold</b>", **SHORT)
    text = result._repr_html_()
    assert "<table>" in text
    assert "&lt;b&gt;bold" in text
    assert f"{result.summary['peak_torque']:.3g}" in text
    assert [name for name, kind in zip(result.runs.column_names, result.runs.schema.types, strict=True)
            if str(kind).startswith(("struct", "list"))] == []  # fmt: skip


def test_a_difference_is_paired_and_says_what_became_worse(tmp_path):
    start = {**SHORT, "randomise.runs": 2, "start.jitter": 0.002}
    one, two = (biped.run("level_normal", jobs=1, **start, **{"ground.friction": mu}) for mu in (1.0, 0.2))
    same = biped.diff(one, one.save(tmp_path / "kept"))
    assert same.passed
    assert "the same to the last digit in all 2 pairs" in repr(same)
    found = biped.diff(one, two, metrics=["peak_force"])
    (row,) = found.metrics.to_pylist()
    assert row["second"] == pytest.approx(two.summary["peak_force"])
    assert row["low"] <= row["change"] <= row["high"]
    assert "<table>" in found._repr_html_()
    with pytest.raises(InputError, match="unknown metric"):
        biped.diff(one, two, metrics=["spead"])


def test_a_check_needs_an_expectation_and_a_page_is_written():
    with pytest.raises(InputError, match="expect: missing"):
        biped.check("upright/own", **SHORT)
    checked = biped.check("upright/own", expect={"falls": {"max": 0}}, **SHORT)
    assert checked.passed
    assert checked.checks[0]["name"] == "falls"
    assert "upright/own" in checked.report("page.html").read_text(encoding="utf-8")


def test_importing_biped_imports_nothing_else():
    code = "import sys, biped; print([n for n in sys.modules if n.startswith(('biped.', 'numpy'))], dir(biped))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("[] ")
    assert "'check', 'compare', 'diff', 'load', 'run', 'sweep'" in done.stdout
    with pytest.raises(AttributeError, match="no attribute 'walk'"):
        biped.walk  # noqa: B018


@pytest.mark.parametrize("runs", [1, 2])
def test_saved_results_are_those_of_the_command(runs):
    changes = [f"randomise.runs={runs}", "start.jitter=0.002"]
    argv = [word for change in [*CHANGES, *changes] for word in ("--set", change)]
    assert main(["run", "level_normal", *argv, "--out", "command"]) in (0, 1)  # its first step begins with a hop
    biped.run("level_normal", **SHORT, **{"randomise.runs": runs, "start.jitter": 0.002}).save("python")
    journal = {"runs.jsonl"}
    theirs, ours = contents("command"), contents("python")
    assert theirs.keys() - journal == ours.keys()
    assert all(theirs[name] == ours[name] for name in ours)


def test_replayed_runs_are_the_same_runs():
    found = biped.run("level_normal", jobs=2, **SHORT, **{"randomise.runs": 2, "start.jitter": 0.002})
    row = found.runs.to_pylist()[1]
    walk = found.replay(1)
    assert row["distance"] == walk.q[-1, 0] - walk.q[0, 0]
    assert set(walk.units) >= {"time", "q", "v", "u", "force"}
    with pytest.raises(InputError, match="run 2: expected the number of a run, 0 … 1"):
        found.replay(2)


@pytest.mark.parametrize(
    ("value", "kept"),
    [(2, 2), (0.1, 0.1), (1e-7, 1e-7), (True, True), ("two words", "two words"),
     ('a "quoted" \\ line\n', 'a "quoted" \\ line\n'),
     ((1, 2.5), [1, 2.5]), (np.float64(0.3), 0.3), (np.arange(3), [0, 1, 2]), (range(2), [0, 1]), (Path("a/b"), "a/b"),
     ({"ground.slope": [0, 1]}, {"ground.slope": [0, 1]}), ([{"at": 0.1}], [{"at": 0.1}]), ({}, {})],
)  # fmt: skip
def test_values_mean_what_they_mean_in_python(value, kept):
    assert tomllib.loads(setting("key", value)) == {"key": kept}


def test_what_is_no_value_is_an_input_error():
    with pytest.raises(InputError, match=r"push\.at: expected a number, .* got object"):
        setting("push", {"at": object()})
    with pytest.raises(InputError, match="did you mean 'ground'"):
        biped.load("level_normal", **{"grund.slope": 2})
    with pytest.raises(InputError, match="level_norml"):
        biped.run("level_norml")


class Limp:
    """Counts its ticks, wherever it was made."""

    def __init__(self, setup=None):
        self.ticks = 0

    def torques(self, sensed):
        self.ticks += 1
        return np.full(6, 1.0 / self.ticks)


def test_a_law_is_a_class_a_function_or_an_instance():
    walks = [biped.run("level_normal", law=law, **SHORT) for law in (Limp, lambda setup: Limp(), Limp())]
    again = biped.run(biped.load("level_normal", law=f"{Path(__file__)}:Limp"), **SHORT)
    for found in [*walks, again]:
        assert found.trajectory.u[0, 0] == 1.0
        assert np.array_equal(found.trajectory.log, walks[0].trajectory.log)
    assert walks[0].scenario.law == f"{Path(__file__)}:Limp"
    assert walks[1].scenario.law == "python:test_a_law_is_a_class_a_function_or_an_instance.<locals>.<lambda>"
    assert walks[2].scenario.law == "python:Limp"


def test_every_run_gets_its_own_copy_of_an_instance():
    mine = Limp()
    found = biped.run("level_normal", law=mine, jobs=1, **SHORT, **{"randomise.runs": 2, "start.jitter": 0.002})
    assert mine.ticks == 0
    assert [found.replay(i).u[0, 0] for i in range(2)] == [1.0, 1.0]


def test_a_saved_law_of_a_notebook_says_that_it_cannot_be_run_again():
    folder = biped.run("level_normal", law=Limp(), **SHORT).save("x")
    with pytest.raises(InputError, match=r"law: expected 'path.py:Class'.*got 'python:Limp'"):
        biped.run(folder / "scenario.toml")


@pytest.mark.parametrize(
    ("changes", "said"),
    [({"law": 3}, "law: expected a class"), ({"law": Limp, "actuation.mode": "generalized"}, "law"),
     ({"law": type("Mute", (), {"__init__": lambda self, setup: None})}, "Mute: expected a method torques")],
)  # fmt: skip
def test_laws_that_cannot_be_used(changes, said):
    with pytest.raises(InputError, match=said):
        biped.run("level_normal", **SHORT, **changes)


def test_show_opens_the_viewer(monkeypatch):
    opened = []
    monkeypatch.setattr(viewer.subprocess, "Popen", lambda argv, **options: opened.append(argv))
    biped.run("level_normal", **SHORT).show()
    ((*words, path),) = opened
    assert "rerun" in words
    assert Path(path).stat().st_size > 10_000


def test_in_a_notebook_the_viewer_is_below_the_cell(monkeypatch):
    class Shell:
        kernel = object()

    shown = []
    monkeypatch.setitem(sys.modules, "IPython", type("IPython", (), {"get_ipython": staticmethod(Shell)}))
    monkeypatch.setattr(rerun.notebook, "HAS_NOTEBOOK", True)
    monkeypatch.setattr(rerun, "notebook_show", lambda **given: shown.append(given))
    biped.run("level_normal", **SHORT).show()
    assert len(shown) == 1
