"""Expectations become verdicts, and verdicts JUnit."""

from __future__ import annotations

import math
import re
import resource
from xml.etree import ElementTree

import pytest

from biped.base.statistics import wilson
from biped.cli.common import all_passed, code_of
from biped.ensemble.checks import Check, judge, judgement, passed, write_junit
from biped.scenario.goals import Bound
from biped.show.results import summary_of


def row(end: str = "completed", flight: float = 0.0, verdict: str = "sound") -> dict:
    return {"end": end, "fell": end == "fell" or verdict == "diverged", "flight": flight, "verdict": verdict}


ROWS = [row()] * 100
SOUND = {"diverged": 0, "doubtful": 0}


def one(bound: Bound, value: float, runs: int = 100, name: str = "walked") -> Check:
    (check,) = judge({name: bound}, {name: value, **SOUND}, [row()] * runs)
    assert (check.name, check.value) == (name, value) or math.isnan(value)
    return check


@pytest.mark.parametrize(
    ("bound", "value", "passed", "words"),
    [
        (Bound(min=0.7), 0.7, True, ">= 0.7"),
        (Bound(min=0.7), 0.69, False, ">= 0.7"),
        (Bound(min=0.7, max=1.0), 0.8, True, "0.7 … 1"),
        (Bound(min=0.7, max=1.0), 1.1, False, "0.7 … 1"),
        (Bound(min=0.7), math.nan, False, ">= 0.7"),
        (Bound(max=0.7), math.nan, False, "<= 0.7"),
    ],
)
def test_means_are_met_or_missed(bound, value, passed, words):
    check = one(bound, value, name="speed")
    assert (check.passed, check.expected) == (passed, words)


@pytest.mark.parametrize(
    ("bound", "value", "runs", "passed"),
    [
        (Bound(max=8), 8, 100, True),
        (Bound(max=8), 9, 100, False),
        (Bound(min=97), 97, 100, True),
        (Bound(min=97), 96, 100, False),
        (Bound(min=97), 20, 20, None),
        (Bound(max=0), 0, 1, True),
    ],
)
def test_a_count_as_a_number_is_of_these_runs(bound, value, runs, passed):
    check = one(bound, value, runs)
    assert check.passed is passed
    assert ("20 runs cannot decide it" in check.why) == (passed is None)


@pytest.mark.parametrize(
    ("bound", "value", "runs", "passed"),
    [
        # Wilson's intervals, by hand: 98 of 100 is 92.998 – 99.45 %, 10 of 10 72.2 – 100 %, 5 of 10 23.7 – 76.3 %.
        (Bound(min="92.9 %"), 98, 100, True),
        (Bound(min="93 %"), 98, 100, None),
        (Bound(min="99.4 %"), 98, 100, None),
        (Bound(min="99.5 %"), 98, 100, False),
        (Bound(min="72.2%"), 10, 10, True),
        (Bound(min="97 %"), 10, 10, None),
        (Bound(min="97 %"), 9, 10, None),
        (Bound(min="97 %"), 5, 10, False),
        (Bound(max="8 %"), 2, 100, True),
        (Bound(max="8 %"), 5, 100, None),
        (Bound(max="0.6 %"), 2, 100, None),
        (Bound(max="0.5 %"), 5, 100, False),
        (Bound(min="20 %", max="80 %"), 5, 10, True),
        (Bound(min="20 %", max="60 %"), 5, 10, None),
        (Bound(min="20 %", max="23 %"), 5, 10, False),
        (Bound(min="100 %"), 10, 10, True),
        (Bound(min="100 %"), 9, 10, False),
        (Bound(max="0 %"), 0, 10, True),
        (Bound(max="0 %"), 1, 10, False),
    ],
)
def test_a_share_is_shown_disproved_or_undecided(bound, value, runs, passed):
    assert one(bound, value, runs).passed is passed


@pytest.mark.parametrize(("share", "count", "runs"), [(0.97, 10, 10), (0.97, 9, 10), (0.3, 4, 10), (0.9, 95, 100)])
def test_as_many_runs_as_an_undecided_check_asks_for_decide_it(share, count, runs):
    check = one(Bound(min=f"{100 * share:g} %"), count, runs)
    assert check.passed is None
    more = int(check.why.rpartition(" ")[2])
    assert more > runs
    for trials, inside in ((more, False), (more - 1, True)):
        low, high = wilson(trials * count / runs, trials)  # the same rate
        assert (low < share < high) == inside


def test_checks_keep_their_order():
    names = ["speed", "falls", "steps"]
    checks = judge({name: Bound(min=0) for name in names}, {"steps": 1, "falls": 2, "speed": 3, **SOUND}, ROWS)
    assert [check.name for check in checks] == names


def test_junit_is_what_ci_reads(tmp_path):
    good = judge({"falls": Bound(max=0)}, {"falls": 0, **SOUND}, ROWS)
    expect = {"speed": Bound(min=0.7), "falls": Bound(max=0), "walked": Bound(min="97 %")}
    bad = judge(expect, {"speed": 0.5, "falls": 0, "walked": 98, **SOUND}, ROWS)
    results = [
        {"scenario": "one", "checks": [check._asdict() for check in good]},
        {"scenario": "two <&>", "checks": [check._asdict() for check in bad]},
    ]
    write_junit(tmp_path / "report.xml", results, [2.0, 6.0])
    root = ElementTree.parse(tmp_path / "report.xml").getroot()
    assert root.tag == "testsuites"
    first, two = root.findall("testsuite")
    assert (first.get("name"), first.get("tests"), first.get("failures")) == ("one", "1", "0")
    assert (first.get("skipped"), two.get("skipped")) == ("0", "1")
    assert (two.get("name"), two.get("tests"), two.get("failures")) == ("two <&>", "3", "1")
    cases = two.findall("testcase")
    assert [case.get("name") for case in cases] == ["speed", "falls", "walked"]
    assert cases[0].find("failure").get("message") == "speed = 0.5, expected >= 0.7"
    assert [part.tag for part in cases[1]] == ["properties"]
    assert [(one.get("name"), one.get("value")) for one in cases[0].find("properties")] == [
        ("value", "0.5"),
        ("expected", ">= 0.7"),
    ]
    assert (two.get("time"), cases[0].get("time")) == ("6.000", "2.000")
    undecided = cases[2].find("skipped")
    assert undecided is not None
    message = undecided.get("message")
    assert message.startswith("walked = 98, expected >= 97 % (98 of 100: 93.0 – 99.4 % with 95 % confidence, too few")


def test_a_scenario_in_several_engines_has_a_name_for_each(tmp_path):
    checks = [one._asdict() for one in judge({"falls": Bound(max=0)}, {"falls": 0, **SOUND}, ROWS)]
    results = [
        {"scenario": name, "engine": engine, "checks": checks, "runs": ROWS, "passed": True}
        for name, engine in (("slope", "mujoco"), ("slope", "drake"), ("level", "mujoco"))
    ]
    names = ["slope in mujoco", "slope in drake", "level"]
    write_junit(tmp_path / "report.xml", results)
    assert [suite.get("name") for suite in ElementTree.parse(tmp_path / "report.xml").getroot()] == names
    assert re.findall(r"^\| (\w+(?: in \w+)?) \| falls", summary_of(results), re.MULTILINE) == names


@pytest.mark.parametrize("verdict", ["diverged", "doubtful"])
def test_what_cannot_be_believed_does_not_pass_unless_it_was_expected(verdict):
    rows = [row(), row("fell", verdict=verdict)]
    summary = {"speed": 1.0, **SOUND, verdict: 1}
    assert passed(judge({"speed": Bound(min=0.0)}, summary | SOUND, [row(), row("fell")]))
    added = judge({"speed": Bound(min=0.0)}, summary, rows)
    assert (added[-1].name, added[-1].value, added[-1].passed) == (verdict, 1, False)
    assert passed(added) is False
    assert passed(judge({verdict: Bound(max=1)}, summary, rows))
    assert passed(judge({verdict: Bound(max=0)}, summary, rows)) is False


@pytest.mark.parametrize("end", ["raised", "lost"])
def test_a_run_that_nobody_can_judge_does_not_pass(end):
    checks = judge({"speed": Bound(min=0.0)}, {"speed": 1.0, **SOUND}, [row(), row(end)])
    assert [check.name for check in checks] == ["speed", end]
    assert passed(checks) is False


def judged(rows: list[dict], expect: dict[str, Bound] | None = None) -> dict:
    summary = SOUND | {"falls": sum(one["fell"] for one in rows)}
    checks = judge(expect or {}, summary, rows)
    return {"passed": passed(checks), "checks": [check._asdict() for check in checks]}


def test_a_run_of_which_nothing_is_expected_has_not_passed_and_fails_by_a_fall():
    assert (judged([row()])["passed"], judgement(judged([row()]))) == (None, "nothing was expected")
    assert judgement(judged([row()] * 20)) == "nothing was expected"
    assert judgement(judged([row("fell")])) == "failed"
    assert judgement(judged([row(flight=1.0)])) == "failed"
    assert judgement(judged([row(flight=math.nan)])) == "nothing was expected", "a run too short for its window"
    assert judgement(judged([row("fell")], {"falls": Bound(max=1)})) == "passed"
    assert judgement(judged([row()] * 10, {"falls": Bound(max="1 %")})) == "undecided"


def test_exit_codes_say_failed_before_undecided():
    good, open_, bad = (judged([row()] * 10, {"falls": Bound(max=most)}) for most in ("50 %", "1 %", 0))
    bad["checks"][0]["passed"] = bad["passed"] = False
    nothing = judged([row()])
    assert [code_of(results) for results in ([good, nothing], [good, open_], [open_, bad, good])] == [0, 3, 1]
    assert [all_passed(results) for results in ([good], [good, nothing], [good, bad])] == [True, None, False]


def test_a_full_disk_leaves_no_empty_report(tmp_path):
    """No file may grow beyond a size: what CI would read as a report without a fault is not there."""
    results = [{"scenario": "one", "checks": [check._asdict() for check in judge({}, SOUND, ROWS)]}]
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    for size in (0, 20):
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
        try:
            with pytest.raises(OSError, match="File too large"):
                write_junit(tmp_path / "report.xml", results)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert list(tmp_path.iterdir()) == []
