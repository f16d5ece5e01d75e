"""Robots of any kind from run to page: every command that looks at results takes them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from biped.cli.common import UNDECIDED
from biped.cli.main import main
from tests.cases import command, write

SCENARIO = """description = "H1 for a moment"
model = "h1"
law = "stand"
duration = 1.3
window = { start = 0.2 }
push = [{ at = 0.1, duration = 0.1, force = [20.0, 10.0, 0.0] }]
[randomise]
runs = 2
[randomise.draw]
"ground.side_slope" = { uniform = [-2.0, 2.0] }
[fall]
height = 0.9
[expect]
stood = { min = 2 }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A campaign, and one of its runs."""
    root = tmp_path_factory.mktemp("general")
    path = root / "s.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    assert main(["run", str(path), "--out", str(root / "both"), "--jobs", "1", "--record"]) == 0
    code = main(["run", str(path), "--only", "1", "--out", str(root / "one")])
    assert code == UNDECIDED, "one run cannot decide whether two stood"
    return root


def test_recordings(folder):
    from biped.show.replay import recording_of

    assert (folder / "both" / "recording.rrd").stat().st_size > 10_000
    assert recording_of(folder / "one").stat().st_size > 10_000


def test_pages_and_reports(folder, capsys):
    page = folder / "page.html"
    assert main(["report", str(folder / "both"), str(folder / "one"), "--html", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    for words in ("stick figure of the walk", "Phase portrait: knee", "20 N", "right leg"):
        assert words in text, words
    assert main(["report", str(folder / "both"), "--out", str(folder / "r.md")]) == 0
    assert "2 of 2" in (folder / "r.md").read_text(encoding="utf-8") or "stood" in (folder / "r.md").read_text()


def test_figures_and_clips(folder):
    assert main(["plot", str(folder / "one")]) == 0
    assert (folder / "one" / "figures" / "walk.png").is_file()
    out = folder / "v.gif"
    assert main(["video", str(folder / "one"), "--out", str(out), "--width", "96", "--fps", "5"]) == 0
    assert out.stat().st_size > 500


def test_eurobench(folder):
    assert main(["export", str(folder / "one"), "--eurobench", str(folder / "eb")]) == 0
    lines = (folder / "eb" / "grf.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1301
    assert sum(float(line.split("; ")[2]) for line in lines[1100:]) / 201 == pytest.approx(51.437 * 9.81, rel=0.05)


def test_diff_check_and_regress(folder, capsys):
    path = str(folder / "s.toml")
    code, told = command(capsys, "check", path, "--jobs", "1")
    assert (code, told["passed"]) == (0, True)
    file = str(folder / "references.json")
    assert main(["regress", path, "--file", file, "--update", "--reason", "first", "--jobs", "1"]) == 0
    code, told = command(capsys, "regress", path, "--file", file, "--jobs", "1")
    assert code == 0
    assert told["verdicts"][0]["verdict"] == "same"
    assert len(json.loads(Path(file).read_text(encoding="utf-8"))["scenarios"]["s"]["runs"]) == 2
    assert main(["run", path, "--out", str(folder / "again"), "--set", "ground.friction=0.9", "--jobs", "1"]) == 0
    assert main(["diff", str(folder / "both"), str(folder / "again"), "--out", str(folder / "d")]) in (0, 1)


def test_what_fell_is_kept_and_seen_again(folder, capsys):
    out = folder / "fell"
    argv = ["run", str(folder / "s.toml"), "--set", "fall.height=0.9999", "--out", str(out), "--jobs", "1"]
    assert main(argv) == 1
    assert sorted(file.suffix for file in (out / "failures").iterdir()) == [".txt", ".txt", ".xz", ".xz"]
    capsys.readouterr()
    from biped.show.results_folder import ResultsFolder

    ending = ResultsFolder(out).ending(0)
    assert ending is not None
    assert ending.end == "fell"


def test_the_api(tmp_path, monkeypatch):
    import biped

    monkeypatch.chdir(tmp_path)

    class Limp:
        def __init__(self, setup):
            self.size = len(setup.robot.drives)

        def torques(self, sensed):
            return [0.0] * self.size

    result = biped.run(write("s.toml", 'model = "walker2d"\nlaw = "stand"\nduration = 0.1\n'), law=Limp)
    assert result.trajectory.u.any() == False  # noqa: E712
    assert result.trajectory.robot.planar
