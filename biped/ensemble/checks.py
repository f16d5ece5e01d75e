"""Expectations become verdicts: [expect] against the ensemble's numbers, JUnit for CI."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from biped.base.replacing import Kind
from biped.base.writing import write_text
from biped.ensemble.columns import batches
from biped.ensemble.rows import LOST, RAISED
from biped.measure.metrics.walking import airborne
from biped.scenario.keys import Bound


class Check(NamedTuple):
    """One expectation and what came.

    Attributes:
        name: Metric.
        value: What was measured; nan if no run has the number.
        expected: The bound in words.
        passed: Whether it holds; a number that is not there fails.
    """

    name: str
    value: float
    expected: str
    passed: bool


def judge(expect: Mapping[str, Bound], summary: Mapping[str, float]) -> list[Check]:
    """Compares the summary of an ensemble with the expectations, in the order they were written."""
    checks = []
    for name, bound in expect.items():
        value = summary[name]
        low = -math.inf if bound.min is None else bound.min
        high = math.inf if bound.max is None else bound.max
        checks.append(Check(name, value, _words(bound), bool(low <= value <= high)))
    return checks


def passed(checks: Sequence[Check], rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether an ensemble passes.

    All expectations hold; no run is lost and no law of a user's own failed; none is doubtful or diverged, unless an
    expectation says how many may be; a single run of which nothing is expected stays up, on the ground.

    Args:
        checks: Its expectations, judged.
        rows: Its runs.
    """
    expected = {check.name for check in checks}
    unsaid = {"diverged", "doubtful", LOST, RAISED} - expected
    sound = not any(end in unsaid for columns in batches(rows, ["end"]) for end in columns["end"])
    alone = len(rows) == 1 and not expected
    return all(check.passed for check in checks) and sound and not (alone and (rows[0]["fell"] or airborne(rows[0])))


def _words(bound: Bound) -> str:
    if bound.min is None:
        return f"<= {bound.max:g}"
    if bound.max is None:
        return f">= {bound.min:g}"
    return f"{bound.min:g} … {bound.max:g}"


JUNIT = Kind("a report of biped check", (".xml",), (b'<testsuites name="biped"',))


def write_junit(path: Path, results: Sequence[Mapping[str, Any]]) -> None:
    """Writes checks as JUnit XML, one suite per scenario, one case per check.

    Args:
        path: The file.
        results: Result objects as `--json` prints them.
    """
    root = ElementTree.Element("testsuites", name="biped")
    for result in results:
        checks = result["checks"]
        failures = [check for check in checks if not check["passed"]]
        suite = ElementTree.SubElement(
            root, "testsuite", name=result["scenario"], tests=str(len(checks)), failures=str(len(failures))
        )
        for check in checks:
            case = ElementTree.SubElement(suite, "testcase", classname=result["scenario"], name=check["name"])
            if not check["passed"]:
                text = f"{check['name']} = {check['value']}, expected {check['expected']}"
                ElementTree.SubElement(case, "failure", message=text)
    ElementTree.indent(root)
    write_text(path, f"<?xml version='1.0' encoding='utf-8'?>\n{ElementTree.tostring(root, encoding='unicode')}\n")
