"""Claims of a campaign, each with its interval, and the smallest effect that so many runs can see."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from biped.base.statistics import POWER, Z95, enough_for, smallest_drop, wilson
from biped.ensemble.checks import word_of
from biped.ensemble.results import goal_at
from biped.measure.metrics.walking import outcome
from biped.scenario.metrics import METRICS, metrics_of_table
from biped.show.page.html import Markup, join, judged, metric_text, table, tag
from biped.show.results import number
from biped.show.words import between, percent

Rows = Sequence[Mapping[str, Any]]
_Z80 = 0.8416212335729143
"""One-sided 80 % quantile of the normal distribution: the power that a visible change is seen with."""


def headline(summary: Mapping[str, Any], runs: int, goal: str = "walked") -> str:
    """How many reached their goal, with the interval."""
    count = int(summary[goal])
    return (
        f"{goal.capitalize()} {count} of {runs}: {percent(count / runs)}, 95 % interval {between(*wilson(count, runs))}"
    )


def alone(row: Mapping[str, Any]) -> str:
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


def expectations(checks: Rows, runs: int) -> Markup | None:
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
                _sign(check["expected"]),
                interval,
                check.get("why", "") if check["passed"] is None or not interval else "",
            )
        )
    head = ("expectation", "", "measured", "expected", "95 % of the rate", "why")
    return table(head, lines, words=(0, 1, 5), more=5)


def numbers(summary: Mapping[str, Any], thesis: Mapping[str, float], rows: Rows, made: int) -> Markup:
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


def enough_words(rate: float, runs: int) -> str | None:
    """How many runs at a point it takes to claim a rate, where there are fewer."""
    enough = enough_for(rate)
    if enough is None or runs >= enough:
        return None
    return f"{runs} runs at a point cannot claim a rate of {percent(rate)}: that takes {enough}, all of which walk."


def _sign(expected: str) -> str:
    return expected.replace(">=", "≥").replace("<=", "≤")


def _named(name: str) -> Markup:
    metric = METRICS.get(name)
    return join([name.replace("_", " ")]) if metric is None else tag("span", metric.words, title=metric.meaning)
