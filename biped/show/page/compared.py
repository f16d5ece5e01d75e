"""The section of `biped compare`: the same scenario in several engines, every metric with its spread."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import msgspec

from biped.base.statistics import same_rate, wilson
from biped.ensemble import campaign
from biped.ensemble.origin import installed
from biped.ensemble.plan import Plan
from biped.measure.metrics.walking import outcome
from biped.measure.trajectory import Trajectory
from biped.scenario.engines import ENGINES, HOME, MUJOCO
from biped.scenario.laws import own_law
from biped.scenario.metrics import metrics_of_table
from biped.scenario.reading import read_scenario
from biped.show.page.frames import Frames, frames_of
from biped.show.page.html import Markup, card, chip, table, tag
from biped.show.page.motion import charts
from biped.show.page.player import PlayedRun, walks
from biped.show.results_folder import read_as
from biped.show.side_by_side import name_of, with_interval
from biped.show.words import between, percent
from biped.studies.comparison import PARTED

Number = int | float | None


class _ComparedRun(msgspec.Struct):
    index: int
    walked: bool
    end: str
    cause: str
    stood: int
    flight: Number = None
    support: Number = None
    alternation: Number = None


class _ComparedResult(msgspec.Struct):
    runs: list[_ComparedRun]


class _Comparison(msgspec.Struct):
    scenario: str
    passed: bool
    parted_at: Number
    metrics: dict[str, dict[str, Any]]
    results: dict[str, _ComparedResult]
    verdict: str = ""
    parted: dict[str, Number] = {}


def section(folder: Path) -> Markup:
    """The section of a comparison's folder.

    Raises:
        InputError: It is broken.
    """
    file = folder / "comparison.json"
    found = read_as(file, _Comparison, "what biped compare writes", "biped compare SCENARIO")
    runs = {engine: result.get("runs", []) for engine, result in found["results"].items()}
    walked = {engine: sum(run["walked"] for run in rows) for engine, rows in runs.items()}
    names = list(map(name_of, runs))
    head = [
        tag("h2", f"{found['scenario']}: {', '.join(names[:-1])} and {names[-1]}" if names else found["scenario"]),
        tag("p", chip(found["passed"], "✓ comparable", "✗ a run diverged"), _verdict(runs, walked), class_="verdict"),
        tag("p", f"The engines {found['verdict']}.", class_="about") if found.get("verdict") else None,
        tag("p", _parted(found.get("parted") or {" ".join(runs): found["parted_at"]}), class_="about"),
    ]
    return tag("section", *head, _rates(runs, walked), *_walkers(folder, runs), tag("h3", "Every metric"),
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


def _rates(runs: Mapping[str, Any], walked: Mapping[str, int]) -> Markup | None:
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
