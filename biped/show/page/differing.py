"""The section of `biped diff`: the verdict, every metric's change with its interval, and the run to look at, twice."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from biped.base.errors import InputError
from biped.base.json import dumps
from biped.base.paired import Estimate
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.measure.metrics.walking import outcome
from biped.scenario.metrics import METRICS
from biped.scenario.reading import read_scenario
from biped.show.diff import HEADS, MOST_SETTINGS, cells, notes_of, ordered
from biped.show.page.frames import frames_of
from biped.show.page.html import Markup, blocks, card, chip, key_words, table, tag
from biped.show.page.player import PlayedRun, walks
from biped.show.page.plot import Frame, legend
from biped.show.results_folder import read_as
from biped.show.words import harmless, value_of
from biped.studies.diff.changes import BETTER, CHANGED, HEADLINE, LEAST_PAIRS, SAME, UNSAID, WORSE, MetricChange

FILE = "diff.json"
Number = int | float | None
_KIND = {BETTER: "good", WORSE: "bad", SAME: "accent", CHANGED: "other", UNSAID: "quiet"}
_WIDEST = 0.5
"""Of the first's mean: changes beyond are drawn at the edge, with their number in the table."""


class _Side(msgspec.Struct):
    name: str
    folder: str
    scenario: str
    runs: int


class _Metric(msgspec.Struct):
    first: Number
    second: Number
    pairs: int
    change: Number
    interval: tuple[Number, Number]
    p: Number
    adjusted_p: Number
    verdict: str


class _PointPair(msgspec.Struct):
    values: dict[str, Any]
    pairs: int
    first: int
    second: int


class _Setting(msgspec.Struct):
    key: str
    first: Any
    second: Any


class _Worst(msgspec.Struct):
    index: int
    outcome: str
    again: str


class _Seed(msgspec.Struct):
    first: int
    second: int
    walked: tuple[bool, bool]


class _Difference(msgspec.Struct):
    passed: bool
    identical: bool
    pairs: int
    margin: float
    first: _Side
    second: _Side
    worse: list[str]
    metrics: dict[str, _Metric]
    points: list[_PointPair]
    settings: list[_Setting]
    worst: _Worst | None
    seeds: list[_Seed]
    headline: tuple[str, ...] = HEADLINE


def section(folder: Path) -> Markup:
    """The section of a folder in which `biped diff` left its numbers.

    Raises:
        InputError: It is broken.
    """
    return _drawn(read_as(folder / FILE, _Difference, "what biped diff writes", "biped diff A B --out DIR"))


def section_of(found: Mapping[str, Any]) -> Markup:
    """The section of a difference, as `biped.studies.diff.study.Difference.as_dict` gives it."""
    return _drawn(harmless(json.loads(dumps(found))))


def _drawn(found: Mapping[str, Any]) -> Markup:
    changes = ordered(
        [_change(name, one) for name, one in found["metrics"].items() if name in METRICS],
        found.get("headline") or HEADLINE,
    )
    first, second = found["first"], found["second"]
    head = [
        tag("h2", f"{first['name']} → {second['name']}"),
        tag("p", chip(found["passed"], "✓ not worse", "✗ worse"), _verdict_line(found, changes), class_="verdict"),
        tag("p", f"First: {first['runs']} runs of {first['scenario']}; second: {second['runs']} runs of "
                 f"{second['scenario']}; {found['pairs']} pairs of one seed.", class_="about"),
    ]  # fmt: skip
    if found["pairs"] < LEAST_PAIRS and not found["identical"]:
        head.append(tag("div", tag("p", tag("strong", "What this could not see")),
                        tag("p", f"{found['pairs']} pairs are too few to tell a change from chance. Means need "
                                 f"{LEAST_PAIRS} pairs, counts six pairs that differ."), class_="unseen"))  # fmt: skip
    lines = [(*cells(one), tag("span", one.verdict, class_=f"verdict-{_KIND[one.verdict]}")) for one in changes]
    return tag(
        "section", *head, _forest(changes, found["margin"]), _rates(found), _settings(found), *_worst(found),
        tag("h3", "Every metric"), table(HEADS, lines, words=(0, 6)),
        *blocks(tuple(notes_of(found["margin"]))),
    )  # fmt: skip


def _change(name: str, one: Mapping[str, Any]) -> MetricChange:
    def real(value: float | None) -> float:
        return math.nan if value is None else float(value)

    low, high = map(real, one["interval"])
    estimate = Estimate(real(one["change"]), low, high, real(one["p"]))
    return MetricChange(name, real(one["first"]), real(one["second"]), one["pairs"], estimate, real(one["adjusted_p"]),
                  one["verdict"] if one["verdict"] in _KIND else UNSAID)  # fmt: skip


def _verdict_line(found: Mapping[str, Any], changes: Sequence[MetricChange]) -> str:
    if found["identical"]:
        return f"The same to the last digit in all {found['pairs']} pairs of runs."
    if found["worse"]:
        return f"Worse: {', '.join(name.replace('_', ' ') for name in found['worse'])}."
    counts = {verdict: sum(one.verdict == verdict for one in changes) for verdict in (BETTER, SAME, UNSAID)}
    return ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count) + "."


def _forest(changes: Sequence[MetricChange], margin: float) -> Markup | None:
    """Changes with their intervals, one below the other; of means as shares of the first's."""
    shown = [one for one in changes if one.verdict != UNSAID and math.isfinite(_relative(one, one.estimate.change))]
    if not shown:
        return None
    frame = Frame(
        (-100.0 * _WIDEST, 100.0 * _WIDEST), (-0.7, len(shown) - 0.3), "change [%]", "",
        rungs=[one.metric.words for one in reversed(shown)], height=70.0 + 18.0 * len(shown), left=190.0,
    )  # fmt: skip
    frame.band((-100.0 * margin, 100.0 * margin), "pushed")
    frame.line((0.0, 0.0), (-0.7, len(shown) - 0.3), "quiet")
    for row, one in enumerate(reversed(shown)):
        kind = _KIND[one.verdict]
        low, at, high = (
            100.0 * min(max(_relative(one, value), -_WIDEST), _WIDEST)
            for value in (one.estimate.low, one.estimate.change, one.estimate.high)
        )
        if math.isfinite(one.estimate.low):
            frame.line((low, high), (row, row), kind)
        frame.dot(at, row, kind, said=f"{one.metric.words}: {cells(one)[3]} ({cells(one)[4]}), {one.verdict}")
    key = legend([(kind, word) for word, kind in _KIND.items() if any(one.verdict == word for one in shown)])
    note = (f"A change within the band of ±{margin:.0%} does not matter. A change of more than {_WIDEST:.0%} is drawn "
            "at the edge; the table below has its number. Counts of runs change in percentage points.")  # fmt: skip
    return tag("div", card("What changed", key, frame.svg("changes"), note=note), class_="cards")


def _relative(one: MetricChange, value: float) -> float:
    """A change as a share: of the runs, or of the first's mean."""
    if one.metric.kind == "count":
        return value
    return value / abs(one.first) if one.first else math.nan


def _rates(found: Mapping[str, Any]) -> Markup | None:
    if not found["points"]:
        return None
    keys = list(found["points"][0]["values"])
    lines = [(*(value_of(one["values"].get(key)) for key in keys), one["pairs"], one["first"], one["second"])
             for one in found["points"]]  # fmt: skip
    heads = (*(key_words(key) for key in keys), "pairs", "first walked", "second walked")
    return tag("div", tag("h3", "Point by point"), table(heads, lines))


def _settings(found: Mapping[str, Any]) -> Markup | None:
    there = found["settings"]
    if not there:
        return None
    lines = [(one["key"], value_of(one["first"]), value_of(one["second"])) for one in there[:MOST_SETTINGS]]
    more = len(there) - MOST_SETTINGS
    rest = tag("p", f"… and {more} more; all are in diff.json.", class_="about") if more > 0 else None
    return tag(
        "div", tag("h3", "Settings that differ"), table(("key", "first", "second"), lines, words=(0, 1, 2)), rest
    )


def _worst(found: Mapping[str, Any]) -> list[Markup]:
    """The run to look at, in both results where their scenarios lie beside them and need nobody's law."""
    worst = found["worst"]
    if worst is None or found["identical"]:
        return []
    said = [
        tag("h3", "The run to look at"),
        tag("p", f"Run {worst['index']} of the second: {worst['outcome']}.", class_="about"),
        tag("code", worst["again"], class_="command"),
    ]
    partner = next((one["first"] for one in found["seeds"] if one["second"] == worst["index"]), None)
    shown = []
    for which, index in (("second", worst["index"]), ("first", partner)):
        frames = None if index is None else _walk(Path(found[which]["folder"]), index)
        if frames is not None:
            shown.append(PlayedRun(f"{which}: {found[which]['name']}", *frames))
    return [*said, tag("div", card("", walks(shown), wide=True), class_="cards")] if shown else said


def _walk(folder: Path, index: int) -> tuple[str, Any] | None:
    file = folder / "scenario.toml"
    if not file.is_file():
        return None
    try:
        plan = Plan(read_scenario(str(file), looking=True), checked=True)
    except InputError:
        return None
    if plan.scenario.law is not None or not 0 <= index < len(plan):
        return None
    trajectory, row = campaign.run_one(plan, index)
    return f"Run {index}: {outcome(row.as_dict())}.", frames_of(trajectory)
