"""Sections of `biped compare` and `biped diff`: every metric with its spread or change, and the run to look at."""

import json
import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.statistics import Estimate, same_rate, wilson
from biped.base.writing import dumps
from biped.ensemble import campaign
from biped.ensemble.journal import installed
from biped.ensemble.plan import Plan
from biped.measure.metrics.walking import outcome
from biped.measure.trajectory import Trajectory
from biped.scenario.engines import ENGINES, HOME, MUJOCO
from biped.scenario.laws import own_law
from biped.scenario.metrics import METRICS, metrics_of_table
from biped.scenario.reading import read_scenario
from biped.show.comparisons import HEADS, MOST_SETTINGS, cells, name_of, notes_of, ordered, with_interval
from biped.show.document import between, harmless, percent, value_of
from biped.show.page.frames import Frames, frames_of
from biped.show.page.html import Frame, Markup, blocks, card, chip, key_words, legend, table, tag
from biped.show.page.player import PlayedRun, charts, walks
from biped.show.results_folder import Number, read_as, stored
from biped.studies.comparison import PARTED
from biped.studies.diff.changes import BETTER, CHANGED, HEADLINE, LEAST_PAIRS, SAME, UNSAID, WORSE, MetricChange

_COMPARED = stored({"runs": [{
    "index": int, "walked": bool, "end": str, "cause": str, "stood": int, "flight?": Number, "support?": Number,
    "alternation?": Number,
}]})  # fmt: skip
_COMPARISON = stored({
    "scenario": str, "passed": bool, "parted_at": Number, "metrics": dict[str, dict[str, Any]],
    "results": dict[str, _COMPARED], "verdict?": str, "parted?": dict[str, Number],
})  # fmt: skip


def comparison_section(folder: Path) -> Markup:
    """The section of a comparison's folder.

    Raises:
        InputError: It is broken.
    """
    file = folder / "comparison.json"
    found = read_as(file, _COMPARISON, "what biped compare writes", "biped compare SCENARIO")
    runs = {engine: result.get("runs", []) for engine, result in found["results"].items()}
    walked = {engine: sum(run["walked"] for run in rows) for engine, rows in runs.items()}
    names = list(map(name_of, runs))
    head = [
        tag("h2", f"{found['scenario']}: {', '.join(names[:-1])} and {names[-1]}" if names else found["scenario"]),
        tag("p", chip(found["passed"], "✓ comparable", "✗ a run diverged"), _verdict(runs, walked), class_="verdict"),
        tag("p", f"The engines {found['verdict']}.", class_="about") if found.get("verdict") else None,
        tag("p", _parted(found.get("parted") or {" ".join(runs): found["parted_at"]}), class_="about"),
    ]
    return tag("section", *head, _engine_rates(runs, walked), *_walkers(folder, runs), tag("h3", "Every metric"),
               _metrics(found["metrics"], list(runs)))  # fmt: skip


def _verdict(runs: Mapping[str, Any], walked: Mapping[str, int]) -> str:
    if not all(runs.values()) or len(runs) < 2:
        return "One of the engines has no runs."
    if all(len(rows) == 1 for rows in runs.values()):
        return "; ".join(f"{name_of(engine)}: {outcome(rows[0])}" for engine, rows in runs.items()) + "."
    places = {engine: "at home" if engine == HOME else f"in {name_of(engine)}" for engine in runs}
    counts = " and ".join(f"{walked[engine]} of {len(rows)} {places[engine]}" for engine, rows in runs.items())
    p = min(same_rate(walked[a], walked[b], len(runs[a]), len(runs[b])) for a, b in combinations(runs, 2))
    same = "the same rate as far as these runs can tell" if p >= 0.05 else "different rates"
    return f"Walked {counts}: {same} (Fisher p = {p:.2g})."


def _parted(pairs: Mapping[str, float | None]) -> str:
    """When the first walkers of each pair of engines part."""
    words = []
    for pair, at in pairs.items():
        names = " and ".join(map(name_of, pair.split()))
        words.append(f"{names} stay together to the end" if at is None else f"{names} part after {at:.2f} s")
    return f"The first walkers: {'; '.join(words)}. They part when base or legs differ by {PARTED} m."


def _engine_rates(runs: Mapping[str, Any], walked: Mapping[str, int]) -> Markup | None:
    if not all(len(rows) > 1 for rows in runs.values()):
        return None
    lines = [(name_of(engine), f"{walked[engine]} of {len(rows)}", percent(walked[engine] / len(rows)),
              between(*wilson(walked[engine], len(rows)))) for engine, rows in runs.items()]  # fmt: skip
    return table(("engine", "walked", "", "95 % interval"), lines)


def _metrics(metrics: Mapping[str, Mapping[str, Any]], engines: Sequence[str]) -> Markup:
    lines, n = [], len(engines)
    for metric in metrics_of_table("engines"):
        row = metrics.get(metric.name)
        if row is None or metric.kind == "count":
            continue
        spread, intervals = row.get("spread"), row.get("intervals", {})
        values = (with_interval(metric, row.get(engine), intervals.get(engine)) for engine in engines)
        lines.append((tag("span", metric.words, title=metric.meaning), *values,
                      "–" if spread is None else f"{100 * spread:.1f} %",
                      metric.text(row["thesis"]) if "thesis" in row else "", metric.unit, metric.meaning))  # fmt: skip
    return table(("", *map(name_of, engines), "spread", "thesis", "", ""), lines, words=(0, n + 3, n + 4), more=n + 4)


def _walkers(folder: Path, runs: Mapping[str, Any]) -> list[Markup]:
    """MuJoCo's first walker with those of the other engines as ghosts, and each of these by itself.

    Only where the scenario lies there and needs nobody's law. An engine that is not installed has no walker.
    """
    if not (folder / "scenario.toml").is_file() or not all(runs.values()):
        return []
    walked: dict[str, tuple[Trajectory, Frames]] = {}
    for engine in sorted(runs, key=lambda engine: engine != MUJOCO):
        plan = Plan(read_scenario(str(folder / "scenario.toml"), [f"engine={engine}"], looking=True))
        if own_law(plan.scenario.law):
            return []
        library = ENGINES[engine].library
        if not library or installed(library):
            trajectory = campaign.run_one(plan, 0)[0]
            walked[engine] = trajectory, frames_of(trajectory)
    if not walked:
        return []
    solid, *ghosts = walked
    said = {engine: f"{name_of(engine)}, run 0: {outcome(runs[engine][0])}." for engine in walked}
    seen = tuple((name_of(engine), walked[engine][1]) for engine in ghosts)
    shown = [PlayedRun("together" if ghosts else name_of(solid), " ".join(said.values()), walked[solid][1], seen)]
    shown += [PlayedRun(name_of(engine), said[engine], walked[engine][1]) for engine in walked if ghosts]
    return [
        tag("h3", "The walk"), tag("div", card("", walks(shown), wide=True), class_="cards"),
        tag("h3", f"Inside the run in {name_of(solid)}"),
        *charts(walked[solid][0], plan.scenario.interval),
    ]  # fmt: skip


FILE = "diff.json"
_KIND = {BETTER: "good", WORSE: "bad", SAME: "accent", CHANGED: "other", UNSAID: "quiet"}
_WIDEST = 0.5
"""Of the first's mean: changes beyond are drawn at the edge, with their number in the table."""


_SIDE = {"name": str, "folder": str, "scenario": str, "runs": int}
_CHANGE = stored({
    "first": Number, "second": Number, "pairs": int, "change": Number, "interval": tuple[Number, Number], "p": Number,
    "adjusted_p": Number, "verdict": str,
})  # fmt: skip
_DIFFERENCE = stored({
    "passed": bool, "identical": bool, "pairs": int, "margin": float, "first": _SIDE, "second": _SIDE,
    "worse": list[str], "metrics": dict[str, _CHANGE], "headline?": tuple[str, ...],
    "points": [{"values": dict[str, Any], "pairs": int, "first": int, "second": int}],
    "settings": [{"key": str, "first": Any, "second": Any}],
    "worst": stored({"index": int, "outcome": str, "again": str}) | None,
    "seeds": [{"first": int, "second": int, "walked": tuple[bool, bool]}],
})  # fmt: skip


def difference_section(folder: Path) -> Markup:
    """The section of a folder in which `biped diff` left its numbers.

    Raises:
        InputError: It is broken.
    """
    return _difference(read_as(folder / FILE, _DIFFERENCE, "what biped diff writes", "biped diff A B --out DIR"))


def section_of_difference(found: Mapping[str, Any]) -> Markup:
    """The section of a difference, as `biped.studies.diff.Difference.as_dict` gives it."""
    return _difference(harmless(json.loads(dumps(found))))


def _difference(found: Mapping[str, Any]) -> Markup:
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
        "section", *head, _forest(changes, found["margin"]), _point_rates(found), _settings(found), *_worst(found),
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


def _point_rates(found: Mapping[str, Any]) -> Markup | None:
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
