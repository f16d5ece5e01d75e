"""What people see of a campaign: tables, figures, the report and the recording say what result.json says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from matplotlib import image

from biped.cli.main import main
from biped.show.replay import chosen
from biped.show.terminal import causes_of
from tests.cases import ENSEMBLE, write

SWEEP = """
[sweep]
"ground.slope" = [0.0, 2.0]
controller = ["normal", "fast"]
[threshold]
rate = 0.5
[thesis]
speed = 0.81
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A finished campaign of two keys in ./c, and its result."""
    where = tmp_path_factory.mktemp("campaign")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        write("e.toml", ENSEMBLE.replace("runs = 6", "runs = 3") + SWEEP)
        assert main(["run", "e.toml", "--out", "c", "--jobs", "1"]) in (0, 1)
    return where


@pytest.fixture
def result(folder, monkeypatch):
    monkeypatch.chdir(folder)
    return json.loads(Path("c/result.json").read_text(encoding="utf-8"))


def is_picture(path: Path) -> bool:
    pixels = image.imread(path)[..., :3]
    return 0.005 < (pixels < 0.9).any(axis=2).mean() < 0.9


def test_terminal(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert main(["run", "e.toml", "--out", "shown", "--jobs", "1"]) in (0, 1)
    out = capsys.readouterr().out
    result = json.loads(Path("shown/result.json").read_text(encoding="utf-8"))
    assert f"walked {result['summary']['walked']} of 12" in out
    assert f"fell {result['summary']['falls']}" in out
    for cause, count in causes_of(result["runs"]):
        assert f"{count} × {cause}" in out
    for point in result["points"]:
        assert f"{point['walked']}/{point['runs']}" in out
    assert "0.81" in out, "the thesis's number"


def test_causes_are_counted():
    runs = [
        {"fell": True, "walked": False, "cause": "fell forward at 0.4 s"},
        {"fell": True, "walked": False, "cause": "fell forward at 0.7 s"},
        {"fell": False, "walked": False, "cause": ""},
        {"fell": False, "walked": True, "cause": ""},
    ]
    assert causes_of(runs) == [("fell forward", 2), ("stayed up without walking on", 1)]


def test_plot(result, capsys):
    assert main(["plot", "c"]) == 0
    drawn = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.stem for path in drawn] == ["rates", "costs", "failures", "velocities"]
    assert all(is_picture(path) for path in drawn)


def test_rates_are_those_of_the_points(result):
    from biped.show.figures.campaign import rate_map, rates

    bars = rates(result["points"], "c").axes[0].patches
    by_slope = sorted(result["points"], key=lambda point: point["values"]["ground.slope"])
    assert [bar.get_height() for bar in bars] == [point["rate"] for point in by_slope]
    grid = rate_map(result["points"], "c").axes[0].images[0].get_array()
    assert grid.ravel().tolist() == [point["rate"] for point in by_slope]


def test_report(result, capsys):
    assert main(["report", "c", "--out", "r.md", "--title", "What came"]) == 0
    text = Path("r.md").read_text(encoding="utf-8")
    assert text.startswith("# What came\n")
    assert f"Walked {result['summary']['walked']} of 12" in text
    for point in result["points"]:
        assert f"| {point['values']['controller']} | {point['walked']}/{point['runs']} |" in text
    for name in ("rates", "costs", "failures", "velocities"):
        assert f"](r/c/{name}.png)" in text
        assert is_picture(Path(f"r/c/{name}.png"))


def test_report_of_a_single_run(result):
    assert main(["run", "e.toml", "--only", "0", "--out", "one"]) in (0, 1)
    assert main(["report", "one", "--out", "one.md"]) == 0
    assert "| speed |" in Path("one.md").read_text(encoding="utf-8")


def test_report_below_a_file_is_refused(result, capsys):
    assert main(["report", "c", "--out", "e.toml/r.md"]) == 2
    assert "e.toml/r/c: cannot be made" in capsys.readouterr().err


def test_chosen_runs():
    def row(index: int, walked: bool, speed: float = 0.0) -> dict:
        return {"index": index, "walked": walked, "fell": not walked, "speed": speed}

    assert chosen([row(4, True)]) == [("run", 4)]
    rows = [row(0, True, 0.5), row(1, True, 0.9), row(2, True, 0.7), *(row(i, False) for i in range(3, 8))]
    assert chosen(rows) == [("best", 1), ("median", 2), ("fell_3", 3), ("fell_4", 4), ("fell_5", 5)]
    assert chosen(rows[3:]) == [("fell_3", 3), ("fell_4", 4), ("fell_5", 5)]


def test_recording_is_made_when_it_is_looked_at(result, monkeypatch):
    import subprocess

    called = []
    monkeypatch.setattr(subprocess, "call", lambda argv: called.append(argv) or 0)
    assert main(["view", "c"]) == 0
    assert called[0][-1] == "c/recording.rrd"
    assert Path("c/recording.rrd").stat().st_size > 10_000
    assert main(["view", "c/recording.rrd"]) == 0
