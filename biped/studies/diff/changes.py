"""What changed from one result to another, metric by metric: how much, how surely, and whether for the better."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from biped.base.paired import UNKNOWN, Estimate, holm, means, shares
from biped.scenario.metrics import METRICS, Metric
from biped.studies.diff.sides import Pairs

LEAST_PAIRS = 5
"""Pairs from which a mean is judged at all."""
LEVEL = 0.05
"""Probability that even one of all verdicts *better* or *worse* is chance."""
MARGIN = 0.05
"""A change within this share of the runs, or of the first result's mean, is none that matters."""
SAME, UNSAID = "same", "cannot say"
BETTER, WORSE, CHANGED = "better", "worse", "changed"


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
        """What it is."""
        return METRICS[self.name]


def change_of(metric: Metric, pairs: Pairs, margin: float) -> MetricChange:
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


def judged(changes: Sequence[MetricChange], margin: float) -> list[MetricChange]:
    """The same with verdicts; those with a direction are one family of tests, the others another."""
    out: dict[str, MetricChange] = {}
    for directed in (True, False):
        members = [change for change in changes if (change.metric.better != "neither") == directed]
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
