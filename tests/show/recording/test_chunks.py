"""No recording holds a column without rows: one opens the viewer at -9223372036 s, with everything collapsed."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from biped.base.errors import InputError
from biped.cli.main import main
from biped.show.recording import layout, record
from biped.show.recording.series import place
from tests.show.recordings import CHANGES, named_in, read, recorded, rerun


def chunks_of(path):
    return RrdReader(str(path)).stream().to_chunks()


def start_of(path):
    """[s] first time of a recording."""
    times = [chunk.to_record_batch().column("time") for chunk in chunks_of(path) if not chunk.is_static]
    return min(np.asarray(time).astype("i8").min() for time in times) / 1e9


STAND = """class Stand:
    def __init__(self, setup):
        self.posture = None

    def torques(self, sensed):
        if self.posture is None:
            self.posture = sensed.q[3:].copy()
        return 300.0 * (self.posture - sensed.q[3:]) - 30.0 * sensed.v[3:]
"""


@pytest.mark.parametrize(
    "argv",
    [
        ("run", "level_normal", "--set", "law=stand.py:Stand"),
        ("run", "robust/stand", "--set", "duration=3.1", "--set", "randomise.runs=1",
         "--set", 'sweep={"push.0.force.0"=[60.0]}'),
        ("run", "level_normal", "--set", "start.q=[0.0, 1.0, 0.9, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0]"),
        ("run", "level_normal", "--set", "randomise.runs=2", "--jobs", "1"),
        ("compare", "level_normal"),
    ],
    ids=["law", "stand", "early fall", "campaign", "compare"],
)  # fmt: skip
def test_no_column_of_a_run_that_goes_nowhere_is_empty(argv, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("stand.py").write_text(STAND, encoding="utf-8")
    short = ["--set", "duration=0.6", "--set", "window.start=0.1", "--set", "window.end=0.6", "--set", "expect={}"]
    out = ["--out", "x", *(["--record"] if argv[0] == "run" else [])]
    assert main([*argv[:2], *short, *argv[2:], *out]) in (0, 1)
    path = Path("x/recording.rrd")
    chunks = chunks_of(path)
    assert len(chunks) > 20
    assert [chunk.entity_path for chunk in chunks if chunk.num_rows == 0] == []
    assert start_of(path) == 0.0
    printed = rerun("print", "-vvv", path)
    assert "rows" in printed.stdout
    assert "with 0 rows" not in printed.stdout
    assert not any(chunk.entity_path.endswith("/series/cost") for chunk in chunks), "there is no cost of standing"


def test_a_ghost_may_have_curves_that_the_first_run_has_not(tmp_path):
    walker = recorded("walker", ["duration=3.0", "window.start=1.0", "window.end=3.0"])
    still = dataclasses.replace(walker.trajectory, log=walker.trajectory.log.copy())
    still.q[:, 0] = 0.0
    runs = [walker._replace(name="still", trajectory=still), walker._replace(ghost=True)]
    path = tmp_path / "two.rrd"
    record(path, runs, title="two")
    assert all(chunk.num_rows for chunk in chunks_of(path))
    assert not read(path, "/still/series/cost")[0]
    assert read(path, "/walker/series/cost")[0]
    named = named_in(layout(place(runs)))
    assert "/walker/series/cost" in named
    assert "/still/series/cost" not in named
    assert "/still/series/velocity" in named


def test_a_run_that_is_never_finite_is_an_error_in_words(tmp_path):
    run = recorded("up hill/push", CHANGES)
    log = np.full_like(run.trajectory.log[:3], np.nan)
    broken = run._replace(trajectory=dataclasses.replace(run.trajectory, log=log))
    with pytest.raises(InputError, match="up hill/push is finite at no time"):
        record(tmp_path / "nan.rrd", [broken], title="nan")
    assert not (tmp_path / "nan.rrd").exists()
