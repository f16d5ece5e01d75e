"""The section of a run, an ensemble or a sweep: verdict, checks numbers, what they could not see, and the walk."""

import math
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from biped.base.files import label
from biped.base.statistics import POWER, Z95, smallest_drop, wilson
from biped.ensemble.checks import GOALS, goal_of, judgement, word_of
from biped.ensemble.results import goal_at
from biped.measure.metrics.walking import outcome
from biped.measure.trajectory import Trajectory
from biped.scenario.laws import own_law
from biped.scenario.metrics import METRICS, metrics_of_table
from biped.show.document import between, harmless, percent, value_of
from biped.show.page import ensembles
from biped.show.page.frames import frames_of
from biped.show.page.html import Markup, card, join, judged, key_words, metric_text, setting, table, tag
from biped.show.page.player import PlayedRun, charts, walks
from biped.show.replay import of_numbers, spread
from biped.show.results import failures, number
from biped.show.results_folder import ResultsFolder, chosen
from biped.studies.sensitivity import explained

READ = 20_000
"""Most runs that charts are made of."""
_LISTED, _MOST = 8, 200
"""Runs that did not walk that are listed at once, and at most."""


def section(folder: Path) -> Markup:
    """The section of a results folder.

    Raises:
        InputError: It is none, or is broken.
    """
    kept = ResultsFolder(folder)
    result, scenario = kept.result, kept.plan.scenario
    rows, summary, points = _looked_at(result["runs"]), result["summary"], result.get("points", [])
    made = len(result["runs"])
    goal, space, alone = goal_of(result), kept.space, made == 1
    path = shlex.quote(label(folder / "scenario.toml"))
    head = [
        tag("h2", result["scenario"]),
        tag("p", f"{scenario.description}. " if scenario.description else "", _runs_line(kept), class_="about"),
        tag("p", judged(judgement(result)), outcome_line(rows[0]) if alone else
            f"{rate_line(summary, made, goal)}; {failures(summary)}.", class_="verdict"),
        expectations_table(result["checks"], made),
        unseen(summary, rows, points, made, goal),
        tag("code", f"biped run {path}{_only(kept)}{_trust(kept)}", class_="command"),
    ]  # fmt: skip
    body = []
    if points:
        body += [tag("h3", "Along the sweep"), _cards(*ensembles.sweep(points, result["thresholds"], space)),
                 ensembles.points_table(points, space)]  # fmt: skip
    if not alone:
        shares = explained(kept.plan, rows, goal)
        spread = ensembles.endings(rows, goal), ensembles.costs(rows, result["thesis"])
        if len(rows) < made:
            body.append(tag("p", f"What follows is of {len(rows)} of the {made} runs, evenly spread.", class_="about"))
        body += [tag("h3", "How the runs went"), _cards(*spread, *ensembles.causes(shares, rows, goal, space))]
    shown = _played(kept, rows)
    if shown:
        body += [tag("h3", "The walk"), _cards(card("", walks([one for one, _, _ in shown]), wide=True))]
        whose = "the run" if alone else f"run {shown[0][2]}"
        body += [tag("h3", f"Inside {whose}"), *charts(shown[0][1], scenario.interval)]
    else:
        body.append(tag("p", kept.again(rows[0]["index"]), class_="about"))
    if not points:
        body += [tag("h3", "Numbers"), numbers_table(summary, result["thesis"], rows, made)]
    if not alone:
        body.append(_failed(folder, kept, rows, goal))
    return tag("section", *head, *body)


def _cards(*cards: Markup | None) -> Markup:
    return tag("div", *cards, class_="cards")


def _runs_line(kept: ResultsFolder) -> str:
    """The runs of a campaign in a line."""
    s, count = kept.plan.scenario, len(kept.result["runs"])
    runs = "" if count == 1 else f"{count} runs of "
    slope = f", slope {value_of(s.ground.slope)}°" if s.ground.slope else ""
    ground = s.ground
    tiles = f", tiles of ±{value_of(ground.tiles.height)} m" if ground.tiles.height else ""
    steps = f", steps of {value_of(ground.steps.rise)} m" if ground.steps.rise else ""
    jitter = f", starts jittered by {value_of(s.start.jitter)} rad" if s.start.jitter else ""
    law = f", law {s.law}" if s.law else f", contacts {s.actuation.contacts}"
    gait = f"gait {s.controller}" if s.controller else f"{Path(s.model).name}"
    return f"{runs}{s.duration:g} s in {s.engine}, {gait}{law}{slope}{tiles}{steps}{jitter}, seed {s.seed}."


def _only(kept: ResultsFolder) -> str:
    rows = kept.result["runs"]
    return f" --only {rows[0]['index']}" if len(rows) == 1 and len(kept.plan) > 1 else ""


def _trust(kept: ResultsFolder) -> str:
    return " --trust" if own_law(kept.plan.scenario.law) else ""


def _looked_at(runs: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The runs as rows, of very many some, evenly spread."""
    if len(runs) <= READ:
        return list(runs)
    numbers = of_numbers(runs, spread(runs, READ))
    return [harmless(numbers[index]) for index in sorted(numbers)]


def _played(kept: ResultsFolder, rows: list[Mapping[str, Any]]) -> list[tuple[PlayedRun, Trajectory, int]]:
    """The runs that are shown with their numbers, of those whose trajectory is there or can be made again."""
    out = []
    for name, row in chosen(rows):
        trajectory = kept.trajectory(row["index"])
        if trajectory is None:
            continue
        values = ", ".join(setting(key, value, kept.space) for key, value in row.get("values", {}).items())
        index, became = row["index"], outcome(row) + (f"; {values}" if values else "")
        frames = frames_of(trajectory, kept.model(index))
        out.append((PlayedRun(name, f"Run {index}: {became}.", frames), trajectory, index))
    return out


def _failed(folder: Path, kept: ResultsFolder, rows: list[Mapping[str, Any]], goal: str) -> Markup | None:
    """Runs that missed their goal, each with the command that shows it."""
    failed, count = [row for row in rows if not row[goal]], len(kept.result["runs"]) - int(kept.result["summary"][goal])
    if not failed:
        return None
    keys = list(dict.fromkeys(key for row in failed for key in row.get("values", {})))
    path = shlex.quote(label(folder / "scenario.toml"))

    def line(row: Mapping[str, Any]) -> tuple[Any, ...]:
        again = tag("code", f"biped run {path} --only {row['index']} --record{_trust(kept)}")
        values = (value_of(row.get("values", {}).get(key)) for key in keys)
        return (row["index"], outcome(row), *values, again)

    head = ("run", "what became of it", *(key_words(key, kept.space) for key in keys), "to see it again")
    words = (1, len(head) - 1)
    listed = table(head, map(line, failed[:_LISTED]), words)
    more = None
    if len(failed) > _LISTED:
        all_of_them = count <= min(len(failed), _MOST)
        opening = (
            f"All {count} runs that did not {GOALS[goal]}" if all_of_them else f"{min(len(failed), _MOST)} of them"
        )
        more = tag("details", tag("summary", opening),
                   table(head, map(line, failed[_LISTED:_MOST]), words))  # fmt: skip
    return tag("div", tag("h3", f"Runs that did not {GOALS[goal]}: {count}"), listed, more)


Rows = Sequence[Mapping[str, Any]]
_Z80 = 0.8416212335729143
"""One-sided 80 % quantile of the normal distribution: the power that a visible change is seen with."""


def rate_line(summary: Mapping[str, Any], runs: int, goal: str = "walked") -> str:
    """How many reached their goal, with the interval."""
    count = int(summary[goal])
    return (
        f"{goal.capitalize()} {count} of {runs}: {percent(count / runs)}, 95 % interval {between(*wilson(count, runs))}"
    )


def outcome_line(row: Mapping[str, Any]) -> str:
    """The outcome of a single run, and the numbers that say most."""
    parts = [f"{outcome(row).capitalize()}: {row['time']:.1f} s, {METRICS['distance'].text(row['distance'])} m"]
    for name in ("speed", "cost_of_transport"):
        if row[name] is not None and math.isfinite(row[name]):
            unit = METRICS[name].unit
            parts.append(f"{METRICS[name].words} {METRICS[name].text(row[name])}{f' {unit}' if unit else ''}")
    return ", ".join(parts) + "."


def mean_of(values: Sequence[float], share: float = 1.0) -> tuple[float, float, float] | None:
    """Mean, half width of its 95 % interval (Student's t) and the change that as many new runs would show.

    `share` of all values are given; the interval is of all.

    A change shows if two such means differ at 5 % in four cases of five: (z95 + z80) s √(2/n).
    """
    n = len(values)
    if n < 3:
        return None
    from scipy.special import stdtrit

    mean, scatter, n = float(np.mean(values)), float(np.std(values, ddof=1)), round(n / share)
    return mean, float(stdtrit(n - 1, 0.975)) * scatter / math.sqrt(n), (Z95 + _Z80) * scatter * math.sqrt(2.0 / n)


def expectations_table(checks: Rows, runs: int) -> Markup | None:
    """A line for every expectation; counts come with the interval of their rate."""
    if not checks:
        return None
    lines = []
    for check in checks:
        metric = METRICS.get(check["name"])
        value, interval = check["value"], ""
        if metric is not None and metric.kind == "count" and value is not None and 0 <= value <= runs:
            interval = between(*wilson(int(value), runs))
        unit = f" {metric.unit}" if metric is not None and metric.unit else ""
        lines.append(
            (
                _named(check["name"]),
                judged(word_of(check)),
                f"{number(value)}{unit}",
                check["expected"].replace(">=", "≥").replace("<=", "≤"),
                interval,
                check.get("why", "") if check["passed"] is None or not interval else "",
            )
        )
    head = ("expectation", "", "measured", "expected", "95 % of the rate", "why")
    return table(head, lines, words=(0, 1, 5), more=5)


def numbers_table(summary: Mapping[str, Any], thesis: Mapping[str, float], rows: Rows, made: int) -> Markup:
    """The metrics of `made` runs: the interval of each mean, the change that would show, and the thesis's number."""
    whose = "mean of the walkers" if any(row["walked"] for row in rows) else "mean of all runs"
    walkers = [row for row in rows if row["walked"]] or list(rows)
    lines = []
    for metric in metrics_of_table("run"):
        if metric.kind == "count":
            continue
        if summary[metric.name] is None or not math.isfinite(summary[metric.name]):
            continue  # such as a cost of transport of a robot that stood
        found = [row[metric.name] for row in walkers if row.get(metric.name) is not None]
        found = [value for value in found if math.isfinite(value)]
        spread = mean_of(found, len(rows) / made)
        lines.append((
            tag("span", metric.words, title=metric.meaning),
            metric_text(metric, summary[metric.name]),
            "" if spread is None else f"± {metric_text(metric, spread[1])}",
            "" if spread is None else metric_text(metric, spread[2]),
            metric_text(metric, thesis[metric.name]) if metric.name in thesis else "",
            metric.unit,
            metric.meaning,
        ))  # fmt: skip
    if len(rows) == 1:
        head = ("metric", "value", "thesis", "unit", "meaning")
        return table(head, [(a, b, e, f, g) for a, b, _, _, e, f, g in lines], (0, 3, 4), 4)
    if not thesis:
        head = (whose, "value", "95 %", "change that would show", "unit", "meaning")
        return table(head, [(*line[:4], *line[5:]) for line in lines], (0, 4, 5), 5)
    head = (whose, "value", "95 %", "change that would show", "thesis", "unit", "meaning")
    return table(head, lines, (0, 5, 6), 6)


def unseen(summary: Mapping[str, Any], rows: Rows, points: Rows, made: int, goal: str = "walked") -> Markup:
    """The limit of this campaign: the smallest drop that as many runs would show.

    Args:
        summary: Of all runs.
        rows: The runs, or some of them.
        points: Of a sweep; none without one.
        made: How many runs there are.
        goal: What a run had to do, as a metric.
    """
    lines: list[Any] = [tag("p", tag("strong", "What this could not see"))]
    if points:
        fewest = min(points, key=lambda point: (point["runs"], -goal_at(point)[1]))
        told = _drop(goal_at(fewest)[1], fewest["runs"], goal)
        lines.append(tag("p", f"At a single point ({fewest['runs']} run{'s' if fewest['runs'] > 1 else ''}): {told}"))
    told = _drop(int(summary[goal]), made, goal)
    lines.append(tag("p", f"All runs together: {told}" if points else told[0].upper() + told[1:]))
    walkers = [row for row in rows if row["walked"]]
    changes = []
    for name in ("speed", "cost_of_transport"):
        spread = mean_of(
            [row[name] for row in walkers if row[name] is not None and math.isfinite(row[name])], len(rows) / made
        )
        if spread is not None and spread[0] and not points:
            changes.append(f"{METRICS[name].words} by less than {percent(spread[2] / abs(spread[0]))}")
    if changes:
        lines.append(tag("p", f"Changes of the mean {' and of the '.join(changes)} would pass unnoticed."))
    if made == 1:
        lines.append(tag("p", "This is one start. A start close to it may end in another way."))
    return tag("div", *lines, class_="unseen")


def _drop(walked: int, runs: int, goal: str = "walked") -> str:
    """The smallest drop of a rate that shows in as many new runs."""
    seen = smallest_drop(walked, runs)
    if seen is not None:
        return (
            f"{runs} more runs would show a drop from {percent(walked / runs)} to {percent(seen)} or below "
            f"(Fisher's test at 5 %, in {percent(POWER)} of cases). A smaller drop would pass unnoticed."
        )
    if walked == 0:
        return f"none {goal}, so nothing could get worse."
    # Four of four against none show, and six of very many.
    enough = "four" if walked == runs else f"about {math.ceil(6 * runs / walked)}"
    return f"{runs} more run{'s' if runs > 1 else ''} could not show any drop; that takes {enough} runs."


def _named(name: str) -> Markup:
    metric = METRICS.get(name)
    return join([name.replace("_", " ")]) if metric is None else tag("span", metric.words, title=metric.meaning)
