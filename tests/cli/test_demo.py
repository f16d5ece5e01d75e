"""`biped demo`: what it runs is there and passes, and its last line is the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from biped.base.files import locate
from biped.cli.commands.demo import PUSH, SPACE, TOUR, visit
from biped.cli.main import main
from biped.scenario.reading import read_scenario

SHORT = ["--set", "duration=0.3", "--set", "push=[]", "--set", "expect={}", "--set", "window.start=0.1"]


@pytest.mark.parametrize("lanes", [PUSH, TOUR, SPACE])
def test_its_scenarios_are_there_and_expect_something(lanes):
    for name in (name for lane in lanes for name in lane):
        locate("scenarios", name, "demo")
        assert read_scenario(name).expect


def test_scenarios_of_a_lane_run_in_order_and_what_they_cannot_use_is_told(tmp_path):
    ended = []
    found = visit([["demo/robot", "no/such"]], tmp_path, [*SHORT, "--set", "window.end=0.3"], ended.append)
    assert [one.scenario for one in ended] == ["demo/robot", "no/such"]
    assert ended == found
    assert (found[0].code, (found[0].folder / "result.json").is_file()) == (0, True)
    assert found[1].code == 2
    assert "no scenario 'no/such'" in found[1].error


@pytest.mark.slow
def test_the_last_line_is_the_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["demo", "--out", "shown"]) == 0
    last = capsys.readouterr().out.strip().splitlines()[-1]
    page = Path(last.removeprefix("The page: "))
    assert page == Path("shown/demo.html")
    text = page.read_text(encoding="utf-8")
    for name in (name for lane in TOUR for name in lane):
        assert name in text
