"""How near a reading comes to all printed numbers at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from biped.studies.readings.definition import Claim, Definition

UP = 2.0
"""Weight of a claim's share of walks, to one of its numbers'."""


class Outcome(NamedTuple):
    """The score of a claim.

    Attributes:
        runs: How many runs were made.
        walked: How many walked.
        numbers: Means of the runs that walked, by metric; empty if none did.
    """

    runs: int
    walked: int
    numbers: Mapping[str, float]


def outcome_of(rows: list[dict[str, Any]], metrics: Mapping[str, float]) -> Outcome:
    """The outcome of a claim's runs."""
    walked = [row for row in rows if row["walked"]]
    numbers = {}
    for name in metrics:
        values = [row[name] for row in walked if row[name] is not None]
        if values:
            numbers[name] = sum(values) / len(values)
    return Outcome(len(rows), len(walked), numbers)


def agreement(study: Definition, claim: Claim, outcome: Outcome) -> float:
    """How well a claim is met: 1 as printed, 0 not at all.

    The share of runs that walk counts twice as much as the printed means together; a mean that is `most` scales off,
    or of which there is none, counts nothing.
    """
    share = min(1.0, outcome.walked / outcome.runs / claim.share)
    if not claim.printed:
        return share
    near = 0.0
    for name, printed in claim.printed.items():
        value = outcome.numbers.get(name)
        if value is not None:
            off = abs(value / printed - 1.0) / study.scale[name]
            near += 1.0 - min(off, study.most) / study.most
    return (UP * share + near / len(claim.printed)) / (UP + 1.0)


def score(study: Definition, outcomes: Mapping[str, Outcome]) -> float:
    """The weighted mean of the agreement with all claims: 1 if everything is as printed."""
    total = sum(claim.weight for claim in study.claim)
    return sum(claim.weight * agreement(study, claim, outcomes[claim.name]) for claim in study.claim) / total
