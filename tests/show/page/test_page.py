"""What the HTML page says is what the results say; nobody's words make anything of it."""

from __future__ import annotations

import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from biped.base.statistics import POWER, detectable_drop, same_rate, smallest_drop
from biped.cli.main import main
from biped.show.page import kind_of
from biped.show.page.html import Frame, steps
from biped.show.results_folder import chosen
from biped.studies.sensitivity import share_of

SWEEP = """
[sweep]
"ground.slope" = [0.0, 2.0]
[threshold]
rate = 0.5
"""
ALSO = (["run", "e.toml", "--only", "1", "--out", "one"],)


class Read(HTMLParser):
    """A page as its elements and its words."""

    def __init__(self, text: str):
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in ("meta", "input", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)


def page(*argv: str) -> tuple[str, Read]:
    assert main(["report", *argv, "--html", "p.html"]) == 0
    text = Path("p.html").read_text(encoding="utf-8")
    return text, Read(text)


def test_the_page_of_a_sweep_and_of_a_run_in_it(result, capsys):
    text, read = page("c", "one")
    assert read.open == []
    words = " ".join(read.words)
    low, high = result["summary"]["walked_interval"]
    assert f"Walked {result['summary']['walked']} of 6" in words
    assert f"{100 * low:.0f} – {100 * high:.0f} %" in words
    assert "What this could not see" in words
    for run in result["runs"]:
        if not run["walked"]:
            assert f"biped run c/scenario.toml --only {run['index']} --record" in words
    assert "biped run one/scenario.toml --only 1" in words
    assert len(text) < 3_000_000
    assert not Path("report.md").exists()  # the page alone was asked for


def test_of_very_many_runs_charts_are_of_some_and_counts_of_all(result, monkeypatch):
    from biped.show.page import campaign

    monkeypatch.setattr(campaign, "READ", 4)
    _, read = page("c")
    words = " ".join(read.words)
    assert "What follows is of 4 of the 6 runs, evenly spread." in words
    assert f"Walked {result['summary']['walked']} of 6" in words
    assert f"Runs that did not walk: {6 - result['summary']['walked']}" in words


def test_it_needs_no_network_and_runs_one_script(result):
    text, read = page("c")
    for _, attributes in read.elements:
        assert not {"src", "href", "onclick", "onload"} & attributes.keys()
    assert [name for name, _ in read.elements].count("script") == 1
    assert "http://" not in text and "https://" not in text and "@import" not in text and "url(" not in text  # noqa: PT018


def test_words_of_a_stranger_are_text(result, tmp_path):
    hostile = "<script>alert(1)</script><img src=x onerror=alert(1)>\"'& \x1b[31m"
    shutil.copytree("c", tmp_path / "c")
    told = result | {"scenario": hostile}
    told["runs"] = [run | ({"cause": hostile} if run["fell"] else {}) for run in told["runs"]]
    told["checks"] = [{"name": "speed", "value": 1.0, "expected": hostile, "passed": True}]
    (tmp_path / "c/result.json").write_text(json.dumps(told), encoding="utf-8")
    text, read = page(str(tmp_path / "c"), "--title", hostile)
    assert read.open == []
    assert [name for name, _ in read.elements].count("script") == 1
    assert "img" not in [name for name, _ in read.elements]
    assert "<script>alert(1)" in "".join(read.words)
    assert "\x1b" not in text


def test_the_kinds_of_results(tmp_path):
    for name, kind in (("comparison.json", "comparison"), ("stability.json", "stability")):
        (tmp_path / kind).mkdir()
        (tmp_path / kind / name).write_text("{}")
        assert kind_of(tmp_path / kind) == kind
    (tmp_path / "result.json").write_text('{"conditions": {}, "runs": 3}')
    assert kind_of(tmp_path) == "search"
    (tmp_path / "result.json").write_text('{"runs": []}')
    assert kind_of(tmp_path) == "campaign"
    assert kind_of(tmp_path / "result.json") == "regress"


def test_a_search_a_study_a_comparison_and_a_regression_have_sections(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tally = {"walked": 9, "runs": 10, "speed": 0.8, "cost_of_transport": 0.2}
    tuned = {
        "scenario": "t",
        "gait": "t/gait.toml",
        "objective": 0.1,
        "before": 0.4,
        "runs": 20,
        "conditions": {"level": tally | {"before": tally | {"walked": 2}}},
        "keys": {"ground.friction": 1.0},
    }
    fit = {"kick": 0.01, "fell": 1, "walks": 100, "radius": 0.5, "interval": [0.4, 0.6], "explained": 0.9,
           "multipliers": [[0.5, 0.1], [-0.2, 0.0]], "stable": True}  # fmt: skip
    sizes = [{"size": 10.0**-k, "after": [0.1, 0.05, 10.0 ** -(k + 1)], "fell": 0, "walks": 12} for k in range(1, 6)]
    basin = {"lean": [-0.1, 0.0, 0.1], "speed": [-0.5, 0.5], "states": 2, "fell": [[2, 0], [0, 0], [1, 0]],
             "walks": [[0, 0], [0, 0], [1, 0]], "returned": [[0, 2], [2, 2], [0, 2]]}  # fmt: skip
    gait = {
        "engine": "home",
        "timestep": 0.001,
        "kind": "stable limit cycle",
        "strides": 40,
        "period": 1.7,
        "period_std": 0.01,
        "fell": 0,
        "walks": 6,
        "exponent": None,
        "sizes": sizes,
        "fit": fit,
        "basin": basin,
    }
    studied = {
        "scenario": "s",
        "stable": True,
        "gaits": [gait, {"engine": "mujoco", "timestep": 1e-3, "failed": "none"}],
    }
    run = {"index": 0, "walked": True, "end": "completed", "cause": "", "stood": 0}
    compared = {
        "scenario": "c",
        "passed": True,
        "parted_at": None,
        "metrics": {"speed": {"home": 0.8, "mujoco": 0.7, "spread": 0.125, "thesis": 0.81}},
        "results": {"home": {"runs": [run] * 20}, "mujoco": {"runs": [run | {"walked": False}] * 20}},
    }
    moved = {"old": 0.8, "new": 0.7, "change": -0.125, "within": False}
    verdict = {
        "scenario": "level",
        "verdict": "physics",
        "runs": 12,
        "identical": 0,
        "walked": [12, 2],
        "fell": [0, 10],
        "likely": 1e-5,
        "metrics": {"speed": moved},
        "exact": True,
        "passed": False,
    }
    for name, file, data in (
        ("t", "result.json", tuned),
        ("s", "stability.json", studied),
        ("c", "comparison.json", compared),
    ):
        Path(name).mkdir()
        (Path(name) / file).write_text(json.dumps(data), encoding="utf-8")
    journal = [{"index": i, "costs": [1.0, 0.5 / i], "walked": i, "runs": 8, "recheck": 0.3} for i in (1, 2, 3)]
    Path("t/runs.jsonl").write_text("\n".join(map(json.dumps, journal)) + "\n{", encoding="utf-8")
    Path("r.json").write_text(json.dumps({"verdicts": [verdict], "passed": False}), encoding="utf-8")
    _, read = page("t", "s", "c", "r.json")
    words = " ".join(read.words)
    assert "Walks 9 of 10" in words
    assert "2 before" in words
    assert "stable limit cycle" in words
    assert "none" in words
    assert "Walked 20 of 20 at home and 0 of 20 in MuJoCo: different rates" in words
    assert "12.5 %" in words
    assert "12 → 2" in words
    for name, file in (("t", "result.json"), ("s", "stability.json"), ("c", "comparison.json")):
        (Path(name) / file).write_text('{"conditions": 3, "runs": 1}', encoding="utf-8")
        assert main(["report", name, "--html", "q.html"]) == 2
        assert not Path("q.html").exists()


def test_runs_that_are_shown(result):
    def row(i, **more):
        return {"index": i, "walked": False, "stood": 0, "end": "fell", "cause": f"fell forward at {i}.000 s",
                "time": float(i), "speed": 0.1 * i} | more  # fmt: skip

    rows = [
        row(1),
        row(2),
        row(3),
        row(4, cause="fell backward at 4.000 s"),
        *(row(i, walked=True, end="completed") for i in (5, 6, 7)),
        row(8, end="lost", cause="lost: x"),
    ]
    assert [(name, run["index"]) for name, run in chosen(rows)] == [
        ("the median walker (run 6)", 6), ("fell forward (3×)", 2), ("fell backward (1×)", 4)
    ]  # fmt: skip


def test_the_smallest_drop_is_seen_in_four_cases_of_five():
    rng = np.random.default_rng(3)
    for walked, runs in ((100, 100), (57, 80), (9000, 10000)):
        rate = smallest_drop(walked, runs)
        assert rate is not None
        again = rng.binomial(runs, rate, 4000)
        most = detectable_drop(walked, runs)
        assert np.mean(again <= most) == pytest.approx(POWER, abs=0.03)
        if runs <= 100:
            assert same_rate(walked, most, runs, runs) < 0.05 <= same_rate(walked, most + 1, runs, runs)
    assert smallest_drop(3, 3) is None
    assert smallest_drop(0, 50) is None


def test_sensitivity_is_that_of_a_rate_that_is_known():
    """p(x) = ½ + a (2x - 1): S = 4 a²/3 of the variance ¼."""
    rng = np.random.default_rng(1)
    found, held = [], 0
    for _ in range(12):
        x = rng.random(400)
        share = share_of("x", x.tolist(), rng.random(400) < 0.5 + 0.4 * (2 * x - 1), rng)
        found.append(share.index)
        held += share.interval[0] <= 4 * 0.4**2 / 3 <= share.interval[1]
    assert np.mean(found) == pytest.approx(4 * 0.4**2 / 3, abs=0.03)
    assert held >= 10
    nothing = share_of("x", rng.random(400).tolist(), rng.random(400) < 0.5, rng)
    assert nothing.interval[1] < 0.08
    even = share_of("x", list(range(80)), np.array([True, False] * 40), rng)  # less than chance gives
    assert even.index < 0.0
    assert even.interval[0] == 0.0
    assert not even.sure
    words = share_of("posture", ["a", "b"] * 40, np.array([True, False] * 40), rng)
    assert words.index == pytest.approx(1.0)
    assert words.sure
    assert words.labels == ["a", "b"]
    assert share_of("same", [1.0] * 40, np.array([True, False] * 20), rng) is None


def test_ticks_are_round_and_marks_stand_where_their_numbers_are():
    assert steps(0.0, 1.0, 5) == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    assert steps(-3.0, 7.0, 6) == pytest.approx([-2.0, 0.0, 2.0, 4.0, 6.0])
    frame = Frame((0.0, 10.0), (0.0, 1.0), "x", "y")
    frame.dot(5.0, 0.5, "accent")
    (circle,) = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', frame.svg("chart"))
    (left, top), (right, bottom) = frame.at(0.0, 1.0), frame.at(10.0, 0.0)
    assert [float(value) for value in circle] == pytest.approx([0.5 * (left + right), 0.5 * (top + bottom)], abs=0.1)


def test_pictures_are_where_kinematics_puts_the_biped(folder, monkeypatch):
    import base64

    from biped.measure.stored import load
    from biped.show.page.frames import UNIT, frames_of

    monkeypatch.chdir(folder)
    run = load(Path("one/trajectory.npz"))
    data = frames_of(run).data()
    rows = np.arange(0, len(run), 25)
    assert data["n"] == len(rows)
    base = np.frombuffer(base64.b64decode(data["base"]), "<f4").reshape(data["n"], 1, 3)
    place = np.frombuffer(base64.b64decode(data["place"]), "<i2").reshape(data["n"], 12, 3) * UNIT + base
    x, y, heights = np.moveaxis(place[:, [3, 4, 8, 9]], -1, 0)
    assert not y.any()
    slope = np.radians(run.slope)
    above = heights * np.cos(slope) - x * np.sin(slope)  # across the ground, as the controller sees them
    np.testing.assert_allclose(above, run.height[rows], atol=UNIT)


@pytest.mark.parametrize("argv", [["nowhere"], ["bad.json"], ["c"]])
def test_bad_input_is_one_sentence(argv, result, capsys):
    Path("bad.json").write_text('{"verdicts": 3}', encoding="utf-8")
    out = "p2.html" if argv != ["c"] else "no/where.html"
    assert main(["report", *argv, "--html", out]) == 2
    said = capsys.readouterr().err
    assert argv[0] in said or out in said
    assert said.startswith("biped: ")
    assert not Path(out).exists()
