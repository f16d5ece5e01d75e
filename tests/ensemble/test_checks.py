"""Expectations become verdicts, and verdicts JUnit."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import pytest

from biped.ensemble.checks import judge, passed, write_junit
from biped.scenario.keys import Bound


@pytest.mark.parametrize(
    ("bound", "value", "passed", "words"),
    [
        (Bound(min=0.7), 0.7, True, ">= 0.7"),
        (Bound(min=0.7), 0.69, False, ">= 0.7"),
        (Bound(max=8), 8, True, "<= 8"),
        (Bound(max=8), 9, False, "<= 8"),
        (Bound(min=0.7, max=1.0), 0.8, True, "0.7 … 1"),
        (Bound(min=0.7, max=1.0), 1.1, False, "0.7 … 1"),
        (Bound(min=0.7), math.nan, False, ">= 0.7"),
        (Bound(max=0.7), math.nan, False, "<= 0.7"),
    ],
)
def test_judge(bound, value, passed, words):
    (check,) = judge({"speed": bound}, {"speed": value})
    assert (check.name, check.passed, check.expected) == ("speed", passed, words)


def test_checks_keep_their_order():
    names = ["speed", "falls", "steps"]
    checks = judge({name: Bound(min=0) for name in names}, {"steps": 1, "falls": 2, "speed": 3})
    assert [check.name for check in checks] == names


def test_junit_is_what_ci_reads(tmp_path):
    good = judge({"falls": Bound(max=0)}, {"falls": 0})
    bad = judge({"speed": Bound(min=0.7), "falls": Bound(max=0)}, {"speed": 0.5, "falls": 0})
    results = [
        {"scenario": "one", "checks": [check._asdict() for check in good]},
        {"scenario": "two <&>", "checks": [check._asdict() for check in bad]},
    ]
    write_junit(tmp_path / "report.xml", results)
    root = ElementTree.parse(tmp_path / "report.xml").getroot()
    assert root.tag == "testsuites"
    one, two = root.findall("testsuite")
    assert (one.get("name"), one.get("tests"), one.get("failures")) == ("one", "1", "0")
    assert (two.get("name"), two.get("tests"), two.get("failures")) == ("two <&>", "2", "1")
    cases = two.findall("testcase")
    assert [case.get("name") for case in cases] == ["speed", "falls"]
    assert cases[0].find("failure").get("message") == "speed = 0.5, expected >= 0.7"
    assert cases[1].find("failure") is None


def row(end: str = "completed", flight: float = 0.0) -> dict:
    return {"end": end, "fell": end in ("fell", "diverged"), "flight": flight}


@pytest.mark.parametrize("end", ["diverged", "doubtful"])
def test_what_cannot_be_believed_does_not_pass_unless_it_was_expected(end):
    rows = [row(), row(end)]
    speed = judge({"speed": Bound(min=0.0)}, {"speed": 1.0})
    assert passed(speed, [row(), row("fell")])
    assert not passed(speed, rows)
    assert passed(judge({end: Bound(max=1)}, {end: 1}), rows)
    assert not passed(judge({end: Bound(max=0)}, {end: 1}), rows)


def test_a_single_run_passes_if_it_stays_up_on_the_ground():
    assert passed([], [row()])
    assert not passed([], [row("fell")])
    assert not passed([], [row(flight=1.0)])
    assert passed([], [row(flight=math.nan)]), "a run too short for its window"
    assert passed(judge({"falls": Bound(max=1)}, {"falls": 1}), [row("fell")])
