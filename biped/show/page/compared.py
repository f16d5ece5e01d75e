"""The section of `biped compare`: the same scenario at home and in MuJoCo, every metric with its gap."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from biped.base.statistics import same_rate, wilson
from biped.ensemble import campaign
from biped.ensemble.plan import Plan
from biped.measure.metrics.walking import outcome
from biped.scenario.laws import own_law
from biped.scenario.metrics import metrics_of_table
from biped.scenario.reading import read_scenario
from biped.show.page.frames import frames_of
from biped.show.page.html import Markup, between, card, chip, percent, table, tag
from biped.show.page.motion import charts
from biped.show.page.player import PlayedRun, walks
from biped.show.page.read import read_as
from biped.studies.comparison import ENGINES, PARTED

Number = int | float | None
_NAMES = {"home": "home", "mujoco": "MuJoCo"}


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
    metrics: dict[str, dict[str, Number]]
    results: dict[str, _ComparedResult]


def section(folder: Path) -> Markup:
    """The section of a comparison's folder.

    Raises:
        InputError: It is broken.
    """
    file = folder / "comparison.json"
    found = read_as(file, _Comparison, "what biped compare writes", "biped compare SCENARIO")
    runs = {engine: found["results"].get(engine, {}).get("runs", []) for engine in ENGINES}
    walked = {engine: sum(run["walked"] for run in runs[engine]) for engine in ENGINES}
    head = [
        tag("h2", f"{found['scenario']}: home and MuJoCo"),
        tag("p", chip(found["passed"], "✓ comparable", "✗ a run diverged"), _verdict(runs, walked), class_="verdict"),
        tag("p", _parted(found["parted_at"]), class_="about"),
    ]
    return tag("section", *head, _rates(runs, walked), *_walkers(folder, runs), tag("h4", "Every metric"),
               _metrics(found["metrics"]))  # fmt: skip


def _verdict(runs: Mapping[str, Any], walked: Mapping[str, int]) -> str:
    home, foreign = (len(runs[engine]) for engine in ENGINES)
    if not home or not foreign:
        return "One of the engines has no runs."
    if home == foreign == 1:
        return "; ".join(f"{_NAMES[engine]}: {outcome(runs[engine][0])}" for engine in ENGINES) + "."
    p = same_rate(walked["home"], walked["mujoco"], home, foreign)
    same = "the same rate as far as these runs can tell" if p >= 0.05 else "different rates"
    return (f"Walked {walked['home']} of {home} at home and {walked['mujoco']} of {foreign} in MuJoCo: {same} "
            f"(Fisher p = {p:.2g}).")  # fmt: skip


def _parted(at: float | None) -> str:
    first = "The first walkers"
    if at is None:
        return f"{first} stay together to the end (no coordinate differs by {PARTED} m or rad)."
    return f"{first} part after {at:.2f} s, when a coordinate differs by {PARTED} m or rad."


def _rates(runs: Mapping[str, Any], walked: Mapping[str, int]) -> Markup | None:
    if not all(len(runs[engine]) > 1 for engine in ENGINES):
        return None
    lines = [(_NAMES[engine], f"{walked[engine]} of {len(runs[engine])}", percent(walked[engine] / len(runs[engine])),
              between(*wilson(walked[engine], len(runs[engine])))) for engine in ENGINES]  # fmt: skip
    return table(("engine", "walked", "", "95 % interval"), lines)


def _metrics(metrics: Mapping[str, Mapping[str, float | None]]) -> Markup:
    lines = []
    for metric in metrics_of_table("engines"):
        row = metrics.get(metric.name)
        if row is None or metric.kind == "count":
            continue
        gap = row.get("gap")
        lines.append((tag("span", metric.words, title=metric.meaning), metric.text(row.get("home")),
                      metric.text(row.get("mujoco")), "–" if gap is None else f"{100 * gap:+.1f} %",
                      metric.text(row["thesis"]) if "thesis" in row else "", metric.unit, metric.meaning))  # fmt: skip
    return table(("", "home", "MuJoCo", "gap", "thesis", "", ""), lines, words=(0, 5, 6), more=6)


def _walkers(folder: Path, runs: Mapping[str, Any]) -> list[Markup]:
    """Both first walkers; only where the scenario lies beside the numbers and needs nobody's law."""
    if not (folder / "scenario.toml").is_file():
        return []
    shown, first = [], None
    for engine in ("mujoco", "home"):
        plan = Plan(read_scenario(str(folder / "scenario.toml"), [f"engine={engine}"], looking=True))
        if own_law(plan.scenario.law) or not runs[engine]:
            return []
        trajectory = campaign.run_one(plan, 0)[0]
        first = first or (trajectory, plan.scenario.interval)
        name = _NAMES[engine]
        shown.append(PlayedRun(name, f"{name}, run 0: {outcome(runs[engine][0])}.", frames_of(trajectory)))
    assert first is not None
    return [
        tag("h4", "The walk"), tag("div", card("", walks(shown), wide=True), class_="cards"),
        tag("h4", "Inside the run in MuJoCo"), *charts(*first),
    ]  # fmt: skip
