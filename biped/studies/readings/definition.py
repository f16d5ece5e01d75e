"""The study of readings: the thesis's claims with their weights, and the places where its text leaves a choice."""

import tomllib
from collections.abc import Mapping
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from msgspec import field

from biped.base.typed import convert

FILE = Path(__file__).with_name("study.toml")

Value = bool | float | str


class Claim(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Something that the thesis prints.

    Attributes:
        name: For people.
        scenario: Where it is put to the test.
        source: Figure or table of the thesis.
        runs: Runs of the search.
        weight: In the score.
        set: `--set` changes of the scenario.
        postures: Whether runs begin in the three printed postures in turn.
        share: Printed share of runs that stay up.
        printed: Printed means by metric.
    """

    name: str
    scenario: str
    source: str
    runs: int
    weight: float
    set: tuple[str, ...] = ()
    postures: bool = False
    share: float = 1.0
    printed: dict[str, float] = field(default_factory=dict)


class Passage(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A place where the text is silent, misprinted or ambiguous.

    Attributes:
        key: The scenario key that decides it.
        values: Alternatives.
        thesis: The sentence or equation that they interpret.
    """

    key: str
    values: tuple[Value, ...]
    thesis: str


class Definition(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The study.

    Attributes:
        base: The reading that the search starts from.
        seed: Of the search.
        confirmed: Of the confirmation.
        most: Scales that a number may at most be off.
        first: Changes of the base that are tried right after it.
        scale: Relative error that costs one unit, by metric.
        claim: What is printed.
        place: Where a choice is left.
    """

    base: str
    seed: int
    confirmed: int
    most: float
    first: tuple[dict[str, Value], ...]
    scale: dict[str, float]
    claim: tuple[Claim, ...]
    place: tuple[Passage, ...]


@cache
def definition() -> Definition:
    """The study as it was written down, study.toml."""
    return convert(tomllib.loads(FILE.read_text(encoding="utf-8")), Definition)


def digest() -> str:
    """A name for the study as it was written down: results of another are not continued."""
    return blake2b(FILE.read_bytes(), digest_size=8).hexdigest()


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
