"""Changes between two results whose runs are paired by seed: how much, how surely, whether for the better."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import label, read_toml
from biped.base.statistics import UNKNOWN, Estimate, holm, means, shares
from biped.ensemble.rows import LOST
from biped.scenario.laws import named_now
from biped.scenario.metrics import METRICS, Metric

Row = Mapping[str, Any]
Pairs = Sequence[tuple[Row, Row]]


class ComparedSide(NamedTuple):
    """One of the two.

    Attributes:
        name: For people.
        folder: Its results folder.
        result: Its result object.
        scenario: Its effective scenario as plain data, whatever version wrote it.
    """

    name: str
    folder: Path
    result: Mapping[str, Any]
    scenario: Mapping[str, Any]

    @property
    def runs(self) -> Sequence[Row]:
        """Its runs but those that were lost."""
        return [run for run in self.result["runs"] if run["end"] != LOST]

    def replay(self, index: int) -> str:
        """The command that makes a run again."""
        trust = " --trust" if self.scenario.get("law") else ""
        return f"biped run {label(self.folder / 'scenario.toml')} --only {index}{trust}"


def side(name: str, folder: Path, result: Mapping[str, Any]) -> ComparedSide:
    """A result with its scenario.

    Raises:
        InputError: Its scenario cannot be read.
    """
    scenario = read_toml(folder / "scenario.toml")
    if "law" in scenario:
        scenario["law"] = named_now(scenario["law"])
    return ComparedSide(name, folder, result, scenario)


def pairs_of(first: ComparedSide, second: ComparedSide) -> Pairs:
    """Runs of the same seed at the same point of a sweep: (first, second).

    Raises:
        InputError: There are none.
    """
    a, b = swept(first), swept(second)
    if a != b:
        raise InputError(
            f"{second.name}: expected a sweep over the same keys as {first.name}'s ({_words(a)}), got {_words(b)}"
        )

    def which(run: Row) -> tuple[str, ...]:
        return str(run.get("seed")), *(repr(run["values"].get(key)) for key in a)

    theirs = {which(run): run for run in second.runs}
    pairs = [(run, theirs[which(run)]) for run in first.runs if which(run) in theirs]
    if not pairs:
        raise InputError(
            f"{first.name} and {second.name}: have no run in common; expected runs of the same seeds (the scenario's "
            "seed) at the same points"
        )
    return pairs


def swept(one: ComparedSide) -> list[str]:
    """Keys that a sweep went over; none where there was no sweep."""
    points = one.result.get("points") or []
    return sorted(points[0]["values"]) if points else []


def _words(keys: Sequence[str]) -> str:
    return ", ".join(keys) or "none"


def settings(first: ComparedSide, second: ComparedSide) -> list[tuple[str, Any, Any]]:
    """Where the scenarios differ; a key that a version does not know is None."""
    a, b = _flat(first.scenario), _flat(second.scenario)
    return [(key, a.get(key), b.get(key)) for key in dict.fromkeys([*a, *b]) if a.get(key) != b.get(key)]


def _flat(value: Any, at: str = "") -> dict[str, Any]:
    if isinstance(value, list | tuple) and any(isinstance(inner, Mapping) for inner in value):
        value = dict(enumerate(value))
    if not isinstance(value, Mapping):
        return {at: value}
    out: dict[str, Any] = {}
    for key, inner in value.items():
        out |= _flat(inner, f"{at}.{key}" if at else str(key))
    return out


LEAST_PAIRS = 5
"""Pairs from which a mean is judged at all."""
LEVEL = 0.05
"""Probability that even one of all verdicts *better* or *worse* is chance."""
MARGIN = 0.05
"""A change within this share of the runs, or of the first result's mean, is none that matters."""
SAME, UNSAID = "same", "cannot say"
BETTER, WORSE, CHANGED = "better", "worse", "changed"
HEADLINE = ("walked", "falls", "speed", "cost_of_transport")
"""Metrics that decide, in the order in which they matter; all others are details."""


class MetricChange(NamedTuple):
    """One metric.

    Attributes:
        name: Of `biped.scenario.metrics.METRICS`.
        first: Of the pairs, the first result's count or mean.
        second: The second's.
        pairs: How many pairs say something: all of a count; of a mean those in which both walked.
        estimate: The change, of a count as a share of the pairs.
        adjusted: `estimate.p` with regard to all metrics that are judged; nan where there is none.
        verdict: `better`, `same`, `worse` or `cannot say`; `changed` of a metric of which neither more nor less is
            better.
    """

    name: str
    first: float
    second: float
    pairs: int
    estimate: Estimate
    adjusted: float
    verdict: str

    @property
    def metric(self) -> Metric:
        """The metric that changed."""
        return METRICS[self.name]


def change_of(metric: Metric, pairs: Pairs) -> MetricChange:
    """One metric, not yet judged with regard to the others."""
    if metric.kind == "count":
        key = "fell" if metric.name == "falls" else metric.name
        table = [sum((bool(a[key]), bool(b[key])) == cell for a, b in pairs) for cell in _CELLS]
        both, first, second, _ = table
        return MetricChange(metric.name, both + first, both + second, len(pairs), shares(*table), math.nan, UNSAID)
    walkers = any(run["walked"] for pair in pairs for run in pair)
    values = [
        (float(a[metric.name]), float(b[metric.name]))
        for a, b in pairs
        if exists(a[metric.name]) and exists(b[metric.name]) and (not walkers or (a["walked"] and b["walked"]))
    ]
    if not values:
        return MetricChange(metric.name, math.nan, math.nan, 0, UNKNOWN, math.nan, UNSAID)
    mine, theirs = (math.fsum(side) / len(values) for side in zip(*values, strict=True))
    estimate = means([b - a for a, b in values])
    return MetricChange(metric.name, mine, theirs, len(values), estimate, math.nan, UNSAID)


_CELLS = ((True, True), (True, False), (False, True), (False, False))


def judged(changes: Sequence[MetricChange], margin: float, headline: Sequence[str]) -> list[MetricChange]:
    """The same with verdicts.

    The headline is one family of tests, all other metrics with a direction another, those without one a third.
    """
    out: dict[str, MetricChange] = {}
    families: dict[str, list[MetricChange]] = {}
    for change in changes:
        family = "headline" if change.name in headline else change.metric.better.replace("more", "less")
        families.setdefault(family, []).append(change)
    for members in families.values():
        testable = [change.estimate.p if _enough(change) else math.nan for change in members]
        for change, adjusted in zip(members, holm(testable), strict=True):
            out[change.name] = change._replace(adjusted=adjusted, verdict=_verdict(change, adjusted, margin))
    return [out[change.name] for change in changes]


def _enough(change: MetricChange) -> bool:
    return change.pairs >= LEAST_PAIRS


def _verdict(change: MetricChange, adjusted: float, margin: float) -> str:
    e, metric = change.estimate, change.metric
    least = margin * (1.0 if metric.kind == "count" else abs(change.first))
    if not _enough(change):
        return UNSAID
    if -least <= e.low and e.high <= least:
        return SAME
    if not adjusted < LEVEL:
        return UNSAID
    if metric.better == "neither":
        return CHANGED
    return BETTER if (e.change > 0.0) == (metric.better == "more") else WORSE


def exists(value: Any) -> bool:
    """Whether there is such a number."""
    return value is not None and math.isfinite(value)
