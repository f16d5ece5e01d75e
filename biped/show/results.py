"""Results of a scenario as a document: how its runs ended, its numbers beside the thesis's, and the checks."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from biped.base.statistics import wilson
from biped.base.writing import Kind as FileKind
from biped.base.writing import write_text
from biped.ensemble.checks import FAILED, NOTHING, PASSED, UNDECIDED, goal_of, judgement, sentence_of, titles, word_of
from biped.ensemble.columns import batches
from biped.ensemble.results import goal_at, threshold_words
from biped.measure.metrics.gait import MOVED
from biped.measure.metrics.pushed import STEP_NAMES
from biped.measure.metrics.walking import TOLD_BY, kind_of, outcome
from biped.scenario.metrics import HEAD, METRICS, metrics_of_table
from biped.show.document import Block, Document, Heading, Items, Kind, Line, Paragraph, Table, Words, between, markdown

WARNED = 10
"""Most runs whose warnings are printed."""
NOWHERE = f"no cost of transport, no slip: moved less than {MOVED:g} m in the window"


def document_of(result: Mapping[str, Any], description: str, setting: Line | None = None) -> Document:
    """A result as a document.

    Args:
        result: As in result.json.
        description: Of the scenario.
        setting: How it was run, in a line; default: nothing is said of it.
    """
    runs, summary = result["runs"], result["summary"]
    blocks: list[Block] = [Heading(f"{result['scenario']} in {result['engine']}")]
    if description:
        blocks.append(Paragraph(description))
    if setting is not None:
        blocks.append(Paragraph(setting))
    if len(runs) == 1:
        run = runs[0]
        blocks.append(Paragraph(f"{outcome(run)}; {run['time']:.2f} s, {run['distance']:.2f} m"))
        if run.get("leg_states"):
            states = run["leg_states"]
            blocks.append(Paragraph(f"leg states {states['cycle']} in {states['share']:.0%} of cycles"))
    else:
        goal = goal_of(result)
        share = f"{summary[goal]} of {len(runs)} (95 % interval {between(*wilson(int(summary[goal]), len(runs)))})"
        blocks.append(Paragraph(f"{goal} {share}, {failures(summary)}"))
        blocks += _items([f"{count} × {cause}" for cause, count in causes_of(runs, goal)])
    blocks += _items(warnings_of(runs))
    if "points" not in result and real(summary["push_impulse"]):  # a sweep's pushes differ
        blocks.append(Paragraph(push_words({**summary, **sizes_of_pushes(runs)})))
    blocks.append(_numbers(result))
    if nowhere(summary):
        blocks.append(Paragraph(NOWHERE, note=True))
    if "points" in result:
        blocks.append(_points(result["points"]))
        blocks += _items([threshold_words(t) for t in result["thresholds"]])
    return (*blocks, *checks_of(result))


def verdict_of(result: Mapping[str, Any], description: str) -> Document:
    """Whether a scenario is as it expects, and its checks, as a document."""
    word = judgement(result)
    why = f": {description}" if description else ""
    return (Heading((result["scenario"], " ", Words(_loud(word), KINDS[word]), why)), *checks_of(result))


def checks_of(result: Mapping[str, Any]) -> list[Block]:
    """A line per check, or that nothing was expected."""
    lines: list[Line] = []
    for check in result["checks"]:
        word = word_of(check)
        lines.append((Words(_loud(word), KINDS[word]), f"  {sentence_of(check, number(check['value']))}"))
    return _items(lines or [NOTHING])


KINDS: dict[str, Kind] = {PASSED: "good", FAILED: "bad", UNDECIDED: "doubt", NOTHING: ""}
"""How a judgement stands out."""


def _loud(word: str) -> str:
    return word.upper() if word == FAILED else word


def _items(lines: Sequence[Line]) -> list[Block]:
    return [Items(tuple(lines))] if lines else []


def _numbers(result: Mapping[str, Any]) -> Table:
    """The metrics of a terminal's table, and what a law logged."""
    summary, thesis = result["summary"], result["thesis"]
    rows = []
    for metric in metrics_of_table("run"):
        theirs = [metric.text(thesis[metric.name]) if metric.name in thesis else ""] if thesis else []
        rows.append((metric.name, metric.text(summary[metric.name]), *theirs, metric.explained))
    for name, values in signals_of(result["runs"]).items():
        rows.append((name, number(values["mean"]), *([""] if thesis else []),
                     f"the law's own signal: {number(values['min'])} … {number(values['max'])}"))  # fmt: skip
    head = ("metric", "value", *(["thesis"] if thesis else []), "meaning")
    return Table(head, tuple(rows), (0, len(head) - 1))


def _points(points: Sequence[Mapping[str, Any]]) -> Table:
    """The points of a sweep."""
    keys, rows = list(points[0]["values"]), []
    for point in points:
        rows.append((
            *(number(point["values"][key]) for key in keys), f"{goal_at(point)[1]} of {point['runs']}",
            between(*point["interval"]), str(point["falls"]), *(METRICS[name].text(point[name]) for name in HEAD),
        ))  # fmt: skip
    heads = (*keys, goal_at(points[0])[0], "95 % interval", "fell", *(METRICS[name].words for name in HEAD))
    return Table(heads, tuple(rows), ())


def number(value: Any) -> str:
    """A number for people: three significant digits, a dash if there is none."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return "–" if not math.isfinite(value) else f"{value:.3g}"
    return str(value)


def signals_of(runs: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Signals of a law of the user's own: mean, smallest and largest over the runs that have it, by name."""
    told: dict[str, tuple[int, float, float, float]] = {}
    for columns in batches(runs, ("signals",)):
        for logged in columns["signals"]:
            if not isinstance(logged, str | dict):  # nothing was logged
                continue
            for name, one in (json.loads(logged) if isinstance(logged, str) else logged).items():
                if real(one["mean"]):
                    count, total, least, most = told.get(name, (0, 0.0, math.inf, -math.inf))
                    told[name] = count + 1, total + one["mean"], min(least, one["min"]), max(most, one["max"])
    return {
        name: {"mean": total / count, "min": least, "max": most} for name, (count, total, least, most) in told.items()
    }


PUSH_NAMES = ("push_impulse", "push_speed", "push_froude")
"""Metrics of how hard a push is, with the sign of its way."""


def push_words(numbers: Mapping[str, Any]) -> str:
    """A push and what came after it, in one line; empty where nobody pushed."""
    if not real(numbers["push_impulse"]):
        return ""
    impulse, speed, share = (number(numbers[name]) for name in PUSH_NAMES)
    told = f"pushed with {impulse} N s, {speed} m/s of the whole robot, {share} sqrt(g leg)"
    if real(numbers["push_share"]):
        told += f", {100.0 * numbers['push_share']:.0f} % of the most that steps of a leg length could catch"
    steps = [numbers[name] for name in STEP_NAMES if real(numbers[name])]
    if real(numbers["recovery_time"]):
        told += f"; recovered in {number(numbers['recovery_time'])} s"
    return f"{told}; next steps {', '.join(number(step) for step in steps)} m" if steps else told


def sizes_of_pushes(runs: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Mean sizes of pushes that go both ways in an ensemble, by metric: a signed mean says nothing of any of them."""
    told: dict[str, list[float]] = {name: [] for name in PUSH_NAMES}
    for columns in batches(runs, PUSH_NAMES):
        for name, values in told.items():
            values += [value for value in columns[name] if real(value)]
    ways = told[PUSH_NAMES[0]]
    if not ways or min(ways) >= 0.0 or max(ways) <= 0.0:
        return {}
    return {name: float(np.mean(np.abs(values))) for name, values in told.items() if values}


def warnings_of(runs: Sequence[Mapping[str, Any]]) -> list[str]:
    """The warnings of the first few runs that have some, and how many there are besides."""
    lines: list[str] = []
    more = 0
    for columns in batches(runs, ("index", "warnings")):
        for index, warnings in zip(columns["index"], columns["warnings"], strict=True):
            if warnings not in ({}, "{}"):
                more += 1
                if more <= WARNED:
                    lines.append(f"run {index}: warnings {warnings}")
    return [*lines, f"{more - WARNED} more runs with warnings"] if more > WARNED else lines


def causes_of(runs: Sequence[Mapping[str, Any]], goal: str = "walked") -> list[tuple[str, int]]:
    """Outcomes of the runs that missed their goal and how often, the commonest first."""
    causes: Counter[str] = Counter()
    for columns in batches(runs, tuple(dict.fromkeys((goal, *TOLD_BY)))):
        for place in np.flatnonzero(~np.asarray(columns[goal], dtype=bool)):
            causes[kind_of({name: columns[name][place] for name in TOLD_BY})] += 1
    return causes.most_common()


def failures(summary: Mapping[str, Any]) -> str:
    """How many fell, how many of those diverged, and how many runs are doubtful, in words."""
    diverged = f" ({summary['diverged']} of them diverged)" if summary["diverged"] else ""
    doubtful = f", {summary['doubtful']} doubtful" if summary["doubtful"] else ""
    return f"fell {summary['falls']}{diverged}{doubtful}"


def nowhere(summary: Mapping[str, Any]) -> bool:
    """Whether there is a speed, but not the distance that a cost of transport is divided by."""
    return real(summary["speed"]) and not real(summary["cost_of_transport"])


def real(value: float | None) -> bool:
    """Whether a number exists."""
    return value is not None and math.isfinite(value)


MARK = "<!-- written by biped check -->"
KIND = FileKind("a summary of biped check", (), (MARK.encode(),))
_HEADS = ("scenario", "metric", "value", "expected", "verdict")


def summary_of(results: Sequence[Mapping[str, Any]]) -> str:
    """The checks of several scenarios in Markdown: a verdict, and a row for each check.

    Args:
        results: Result objects as `--json` prints them.
    """
    words = [judgement(result) for result in results]
    failed = words.count(FAILED)
    verdict = f"{failed} of {len(words)} scenarios failed" if failed else f"{len(words)} scenarios, none failed"
    rows: list[tuple[Line, ...]] = []
    for name, result in zip(titles(results), results, strict=True):
        count = len(result["runs"])
        for check in result["checks"]:
            word = word_of(check)
            of = f" of {count}" if check["name"] in ("walked", "stood", "sat", "falls") else ""
            row = (name, check["name"], f"{number(check['value'])}{of}", check["expected"], Words(word, KINDS[word]))
            rows.append(row)
        if not result["checks"]:
            rows.append((name, "–", "–", "–", NOTHING))
    blocks = (Heading("Does it walk?", 2), Paragraph(Words(verdict, "bad" if failed else "strong")))
    return markdown((*blocks, Table(_HEADS, tuple(rows), (0, 1, 3, 4)))) + f"\n{MARK}\n"


def write_summary(path: Path, results: Sequence[Mapping[str, Any]]) -> None:
    """Writes it.

    Raises:
        OSError: It cannot be written.
    """
    write_text(path, summary_of(results))
