"""Expectations are judged: [expect] against an ensemble's numbers, as words for people and as JUnit for CI.

A check passes, fails, or is undecided. A bound on a mean, or on a count as a number, is met or missed by these runs. A
share of the runs is a statement on the rate behind them: it passes when Wilson's 95 % interval of the rate lies within
it, fails when the interval lies outside it, and is undecided in between, which more runs would decide.
"""

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from biped.base.statistics import trials_to_tell, wilson
from biped.base.writing import Kind, write_text
from biped.ensemble.columns import batches
from biped.ensemble.rows import LOST, RAISED
from biped.measure.metrics.walking import FLIGHT, airborne
from biped.scenario.goals import Bound, share_of
from biped.scenario.metrics import METRICS

PASSED, FAILED, UNDECIDED, NOTHING = "passed", "failed", "undecided", "nothing was expected"
"""Judgements of a scenario or of one of its checks."""


GOALS = {"walked": "walk", "stood": "stand", "sat": "sit"}
"""Metrics that say what a run has to do, and their verbs."""


class Check(NamedTuple):
    """One expectation and how it was met.

    Attributes:
        name: Metric.
        value: What was measured; nan if no run has the number.
        expected: The bound in words.
        passed: Whether it holds; a number that is not there fails; None: undecided with so few runs.
        why: How sure that is, in words; empty where nothing is left to say.
    """

    name: str
    value: float
    expected: str
    passed: bool | None
    why: str = ""


def judge(expect: Mapping[str, Bound], summary: Mapping[str, float], rows: Sequence[Mapping[str, Any]]) -> list[Check]:
    """Compares an ensemble with its expectations, in the order they were written.

    What goes without saying follows if it is broken: no run is lost and no law of a user's own fails; no numbers are
    doubtful or diverged unless [expect] says how many may be; a single run of which nothing is expected stays up, on
    the ground.

    Args:
        expect: The expectations.
        summary: Counts and means of the ensemble.
        rows: Its runs.
    """
    checks = [_check(name, bound, summary[name], len(rows)) for name, bound in expect.items()]
    return checks + _implied(set(expect), summary, rows)


def passed(checks: Sequence[Check]) -> bool | None:
    """Whether an ensemble passes all its checks; None if nothing was expected of it, or a check is undecided."""
    verdicts = [check.passed for check in checks]
    if False in verdicts:
        return False
    return None if None in verdicts or not verdicts else True


def judgement(result: Mapping[str, Any]) -> str:
    """The judgement on a result in a word or two: `PASSED`, `FAILED`, `UNDECIDED` or `NOTHING`.

    Args:
        result: As `--json` prints it.
    """
    if result["passed"] is False:
        return FAILED
    if not result["checks"]:
        return NOTHING
    return UNDECIDED if result["passed"] is None else PASSED


def goal_of(result: Mapping[str, Any]) -> str:
    """The metric that says what runs had to do: the first of `GOALS` that was expected, `walked` if none was."""
    return goal_among([check["name"] for check in result["checks"]])


def goal_among(expected: Collection[str]) -> str:
    """The goal among the names of expected metrics: the first of `GOALS`, `walked` if there is none."""
    return next((goal for goal in GOALS if goal in expected), "walked")


def word_of(check: Mapping[str, Any]) -> str:
    """The judgement on one check in a word."""
    return UNDECIDED if check["passed"] is None else PASSED if check["passed"] else FAILED


def sentence_of(check: Mapping[str, Any], value: str) -> str:
    """A check in words, its judgement aside.

    Args:
        check: As in a result.
        value: Its value as it is to be written.
    """
    why = f" ({check['why']})" if check.get("why") else ""
    return f"{check['name']} = {value}, expected {check['expected']}{why}"


def _check(name: str, bound: Bound, value: float, runs: int) -> Check:
    given = [one for one in (bound.min, bound.max) if one is not None]
    if any(share_of(one) is not None for one in given):
        return _share(name, bound, int(value), runs)
    low = -math.inf if bound.min is None else float(bound.min)
    high = math.inf if bound.max is None else float(bound.max)
    if METRICS[name].kind == "count" and low > runs:
        why = f'{_runs(runs)} cannot decide it; a share such as "97 %" can be expected of any number of runs'
        return Check(name, value, words_of(bound), None, why)
    return Check(name, value, words_of(bound), bool(low <= value <= high))


def _share(name: str, bound: Bound, count: int, runs: int) -> Check:
    """A check of a rate, of which the runs are a sample."""
    low, high = wilson(count, runs)
    verdicts, needed = [], []
    for which, limit in (("min", bound.min), ("max", bound.max)):
        share = None if limit is None else share_of(limit)
        if share is None:
            continue
        up = which == "min"
        if share in (0.0, 1.0):  # all of these runs, or none of them: one other disproves it
            verdicts.append(count >= share * runs if up else count <= share * runs)
            continue
        met, missed = (low >= share, high < share) if up else (high <= share, low > share)
        verdicts.append(True if met else False if missed else None)
        if verdicts[-1] is None:
            needed.append(trials_to_tell(count / runs, share))
    holds = False if False in verdicts else None if None in verdicts else True
    why = f"{count} of {runs}: {100 * low:.1f} – {100 * high:.1f} % with 95 % confidence"
    if holds is None:
        most = max(needed, default=None, key=lambda one: math.inf if one is None else one)
        why += ", too few runs to tell" + ("" if most is None else f"; at this rate it takes {most}")
    return Check(name, count, words_of(bound), holds, why)


def _implied(said: set[str], summary: Mapping[str, float], rows: Sequence[Mapping[str, Any]]) -> list[Check]:
    """Expectations that go without saying and do not hold."""
    counts: dict[str, float] = {name: summary[name] for name in ("diverged", "doubtful")}
    ends = [columns["end"] for columns in batches(rows, ["end"])]
    counts |= {name: int(sum((end == name).sum() for end in ends)) for name in (LOST, RAISED)}
    broken = [
        Check(name, count, "<= 0", False, "nothing else was expected")
        for name, count in counts.items()
        if count and name not in said
    ]
    if len(rows) == 1 and not said:
        if rows[0]["fell"] and not broken:
            broken.append(Check("falls", 1, "<= 0", False, "it has to stay up"))
        elif airborne(rows[0]):
            broken.append(Check("flight", rows[0]["flight"], f"< {FLIGHT:g}", False, "it has to stay on the ground"))
    return broken


def _runs(count: int) -> str:
    return "one run" if count == 1 else f"{count} runs"


def words_of(bound: Bound) -> str:
    """A bound in words."""
    low, high = ("" if one is None else one if isinstance(one, str) else f"{one:g}" for one in (bound.min, bound.max))
    if not low:
        return f"<= {high}"
    return f"{low} … {high}" if high else f">= {low}"


JUNIT = Kind("a report of biped check", (".xml",), (b'<testsuites name="biped"',))


def titles(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of results as `--json` prints them; of a scenario that was checked in several engines, with the engine."""
    counts = Counter(result["scenario"] for result in results)
    return [f"{result['scenario']} in {result['engine']}" if counts[result["scenario"]] > 1 else result["scenario"]
            for result in results]  # fmt: skip


def write_junit(path: Path, results: Sequence[Mapping[str, Any]], seconds: Sequence[float] = ()) -> None:
    """Writes checks as JUnit XML: one suite per scenario, one case per check; what is undecided is skipped.

    A suite has the time that its scenario took, and each case the value and the bound as properties.

    Args:
        path: The file.
        results: Result objects as `--json` prints them.
        seconds: [s] that each took; default: it is not said.
    """
    root = ElementTree.Element("testsuites", name="biped")
    for title, result, taken in zip_longest(titles(results), results, seconds):
        words = [word_of(check) for check in result["checks"]]
        suite = ElementTree.SubElement(
            root, "testsuite", name=title, tests=str(len(words)), failures=str(words.count(FAILED)),
            skipped=str(words.count(UNDECIDED)),
        )  # fmt: skip
        # Its checks are of the same runs: what these took is shared out among them.
        if taken is not None:
            suite.set("time", f"{taken:.3f}")
        for check, word in zip(result["checks"], words, strict=True):
            case = ElementTree.SubElement(suite, "testcase", classname=title, name=check["name"])
            if taken is not None:
                case.set("time", f"{taken / len(words):.3f}")
            properties = ElementTree.SubElement(case, "properties")
            for name in ("value", "expected"):
                ElementTree.SubElement(properties, "property", name=name, value=str(check[name]))
            if word != PASSED:
                name = "failure" if word == FAILED else "skipped"
                ElementTree.SubElement(case, name, message=sentence_of(check, str(check["value"])))
    ElementTree.indent(root)
    write_text(path, f"<?xml version='1.0' encoding='utf-8'?>\n{ElementTree.tostring(root, encoding='unicode')}\n")
