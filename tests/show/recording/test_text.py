"""The pages beside the picture: what they say, and that nobody else says anything on them."""

import dataclasses
import math

import pytest

from biped.show.recording import numbers, record, result
from tests.show.recordings import CHANGES, read, recorded


@pytest.fixture(scope="module")
def run():
    return recorded("run", CHANGES)


def test_verdict_five_numbers_and_what_failed(run):
    row = {
        "index": 3, "seed": 17, "values": {"ground.friction": 0.5}, "fell": True, "walked": False, "end": "fell",
        "cause": "fell forward at 1.100 s", "speed": 0.70312,
        "cost_of_transport": None, "double_support": 0.234, "peak_torque": 200.0, "step_length": math.nan,
        "peak_force": 5988.1,
    }  # fmt: skip
    told = run._replace(
        title="level_normal, run 3", metrics=row,
        checks=[
            {"name": "speed", "value": 0.70312, "expected": ">= 0.9", "passed": False},
            {"name": "falls", "value": 0, "expected": "<= 0", "passed": True},
            {"name": "walked", "value": 9, "expected": ">= 97 %", "passed": None, "why": "too few"},
        ],
    )  # fmt: skip
    text = result(told)
    assert text.splitlines()[0] == r"## level\_normal, run 3: fell forward at 1.100 s"
    assert "120 N forward, 30 N up, 0.4 to 0.6 s" in text
    assert "slope +5°" in text
    five = [line for line in text.splitlines() if line.startswith("| ") and line.count("|") == 3 and line[2:4] != "in"]
    assert five == [
        "| speed | 0.703 m/s |", "| cost of transport | – |", "| double support | 23.4 % |", "| step length | – |",
        "| peak torque | 200 N m |",
    ]  # fmt: skip
    assert "**FAILED**: speed\n" in text
    assert r"| speed | \>= 0.9 | 0.7031 | **FAILED** |" in text
    assert "seed" not in text
    rest = numbers(told)
    for line in ("- index: 3", "- seed: 17", "- ground.friction: 0.5", "| peak force | 5990 N | largest normal"):
        assert line in rest
    assert "{" not in text + rest


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ({"end": "completed", "walked": True, "stood": 0}, "walked"),
        ({"end": "completed", "walked": False, "stood": 1}, "stood still"),
        (
            {"end": "doubtful", "walked": False, "cause": "energy not accounted for"},
            "stayed up; doubtful: energy not accounted for",
        ),
        ({}, "stayed up to the end"),
    ],
)
def test_the_verdict_is_that_of_the_row(run, row, said):
    assert result(run._replace(metrics=row)).splitlines()[0].endswith(f": {said}")


def test_words_of_a_stranger_are_text_in_markdown(run):
    hostile = "![x](http://e.example/p.png) <b> `a` | c\x1b[31m\u202e"
    told = run._replace(
        trajectory=dataclasses.replace(run.trajectory, pushes=((0.1, 0.2, 1.0, 0.0, hostile),)), title=hostile,
        metrics={"values": {hostile: hostile}},
        checks=[{"name": hostile, "value": 1.0, "expected": hostile, "passed": True}],
    )  # fmt: skip
    for text in (result(told), numbers(told)):
        assert r"\!\[x\](http://e.example/p.png) \<b\> \`a\` \| c\\x1b\[31m\\u202e" in text
        assert all(line.isprintable() for line in text.splitlines())
        assert "[x]" not in text


def test_a_scenario_cannot_end_its_own_page(run, tmp_path):
    text = 'description = """\n```\n# Loud \x1b[31m\n"""'
    record(tmp_path / "s.rrd", [run._replace(scenario_text=text)], title="s")
    page = read(tmp_path / "s.rrd", "/run/scenario")[1]["TextDocument:text"][0]
    assert page.startswith("````toml\n")
    assert page.endswith("\n````")
    assert r"# Loud \x1b[31m" in page
