"""The study of readings: the thesis's claims with their weights, and the places where its text leaves a choice.

Readings are tried one after another: every single change of the base, then changes of the best ones so far.
"""

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from msgspec import field

from biped.base.files import folder as folder_of
from biped.base.typed import convert
from biped.ensemble.backend import Jobs, Progress, silent
from biped.ensemble.journal import Journal, origin_of
from biped.scenario.vary import setting, stream
from biped.studies.folders import writing
from biped.studies.run import plan_of, run_plan

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


POSTURES = 'randomise.draw={"start.posture"={grid=["heel_toe","flat","single"]}}'
MOST_CHANGES = 3
"""Of a reading, in one step."""
PARENTS = 4
"""The best readings so far, of which one is changed."""
KIND = 0.03
"""Loss of score by a change alone that makes it e times less likely to be proposed."""
NAMED = "bounded", "plastic", "clipped", "touching"
"""Readings that are confirmed whatever a search finds."""
CONFIRMED_BEST = 4
"""Readings of a search that are confirmed beside the named ones."""
SEARCH, CONFIRMED = "search.jsonl", "confirmed.jsonl"


class TriedReading(NamedTuple):
    """A reading that was tried.

    Attributes:
        reading: The named reading below it.
        changes: What differs from that, by key.
        outcomes: By claim.
        score: 1 if everything is as printed.
    """

    reading: str
    changes: Mapping[str, Value]
    outcomes: Mapping[str, Outcome]
    score: float


def search(tries: int, jobs: Jobs, out: Path, progress: Progress = silent) -> list[TriedReading]:
    """Tries readings until so many were tried, those of an earlier call in the same folder among them.

    Args:
        tries: How many.
        jobs: Processes, or a cluster.
        out: Folder of the journal.
        progress: Told of every reading.

    Raises:
        InputError: The folder cannot be written, or holds another study.
    """
    study = definition()
    tried, note = _journal(out / SEARCH, study.seed)
    with progress("readings", tries, min(len(tried), tries)) as step:
        while len(tried) < tries:
            found = trial(study, study.base, proposal(study, tried), study.seed, None, jobs)
            tried.append(found)
            note(found)
            step()
    return tried


def confirm(
    tried: Sequence[TriedReading], runs: int, jobs: Jobs, out: Path, progress: Progress = silent
) -> list[TriedReading]:
    """Tries the best readings of a search and the named ones on seeds that no search has seen.

    Args:
        tried: The search.
        runs: Runs of each claim.
        jobs: Processes, or a cluster.
        out: Folder of the journal.
        progress: Told of every reading.
    """
    study = definition()
    again, note = _journal(out / CONFIRMED, study.confirmed)
    wanted: list[tuple[str, Mapping[str, Value]]] = [(name, {}) for name in NAMED]
    wanted += [(study.base, one.changes) for one in best(tried)[:CONFIRMED_BEST] if one.changes]
    known = [(one.reading, dict(one.changes)) for one in again]
    left = [(reading, changes) for reading, changes in wanted if (reading, dict(changes)) not in known]
    with progress("confirmation", len(wanted), len(wanted) - len(left)) as step:
        for reading, changes in left:
            found = trial(study, reading, changes, study.confirmed, runs, jobs)
            again.append(found)
            note(found)
            step()
    return again


def best(tried: Sequence[TriedReading]) -> list[TriedReading]:
    """Readings, the best first."""
    return sorted(tried, key=lambda one: -one.score)


def proposal(study: Definition, tried: Sequence[TriedReading]) -> dict[str, Value]:
    """The reading to try next: the base, the study's first ones, single changes, then changes of the best so far.

    Of the best, one to three places are changed; what did well alone is proposed more often.
    """
    base = based(study)
    singles = [(place.key, value) for place in study.place for value in place.values if base[place.key] != value]
    listed = [{}, *study.first, *({key: value} for key, value in singles)]
    if len(tried) < len(listed):
        return dict(listed[len(tried)])
    random = stream(study.seed, f"reading {len(tried)}")
    known = [dict(one.changes) for one in tried]
    alone = {next(iter(one.changes.items())): one.score for one in tried if len(one.changes) == 1}
    choices = [*base.items(), *singles]
    gain = np.array([alone.get(choice, tried[0].score) for choice in choices]) - tried[0].score
    likely = np.exp(np.minimum(gain, 0.0) / KIND)
    parents = best(tried)[:PARENTS]
    while True:
        changes = dict(parents[random.integers(len(parents))].changes)
        count = random.integers(1, MOST_CHANGES + 1)
        for index in random.choice(len(choices), size=count, replace=False, p=likely / likely.sum()):
            key, value = choices[index]
            changes.pop(key, None)
            if value != base[key]:
                changes[key] = value
        if changes not in known:
            return changes


def based(study: Definition) -> dict[str, Value]:
    """The choice of the base at every place."""
    s = plan_of("level_normal", [f"reading={study.base}"]).scenario
    found = {}
    for place in study.place:
        table, _, key = place.key.partition(".")
        found[place.key] = getattr(getattr(s, table), key)
    return found


def trial(
    study: Definition, reading: str, changes: Mapping[str, Value], seed: int, runs: int | None, jobs: Jobs
) -> TriedReading:
    """Puts a reading to the test of all claims.

    Args:
        study: The study.
        reading: A named reading.
        changes: What differs from it.
        seed: Of all runs.
        runs: Of each claim; default: those of the search.
        jobs: Processes, or a cluster.
    """
    outcomes = {}
    for claim in study.claim:
        plan = plan_of(claim.scenario, list(_settings(claim, reading, changes, seed, runs or claim.runs)))
        outcomes[claim.name] = outcome_of(list(run_plan(claim.name, plan, jobs).result["runs"]), study.scale)
    return TriedReading(reading, changes, outcomes, score(study, outcomes))


def _settings(claim: Claim, reading: str, changes: Mapping[str, Value], seed: int, runs: int) -> Iterator[str]:
    """`--set` changes of a claim under a reading; the reading's come last, where they replace the claim's."""
    yield from (f"reading={reading}", f"seed={seed}", f"randomise.runs={runs}", *claim.set)
    if claim.postures:
        yield POSTURES
    for key, value in changes.items():
        if not any(word.startswith("sweep=") and f'"{key}"' in word for word in claim.set):
            yield setting(key, value)


def _journal(path: Path, seed: int) -> tuple[list[TriedReading], Callable[[TriedReading], dict[str, Any]]]:
    """Readings that a journal holds, and what adds one to it."""
    about = {key: text for key, text in origin_of(plan_of("level_normal", [])).items() if key != "scenario"}
    readings = sorted(folder_of("readings").glob("*.toml"))
    about |= {"study": digest(), "seed": str(seed), "readings": str(len(readings))}
    journal = Journal(path, about)
    with writing(f"--out {path.parent}", "choose another folder"):
        path.parent.mkdir(parents=True, exist_ok=True)
        records, _ = journal.read()
    tried = [from_dict(one) for one in records]

    def note(one: TriedReading) -> dict[str, Any]:
        return journal.note(as_dict(one))

    return tried, note


def as_dict(one: TriedReading) -> dict[str, Any]:
    """The record of a reading in the journal."""
    return one._asdict() | {"outcomes": {name: outcome._asdict() for name, outcome in one.outcomes.items()}}


def from_dict(one: Mapping[str, Any]) -> TriedReading:
    """The reading that `as_dict` wrote down."""
    outcomes = {name: Outcome(**outcome) for name, outcome in one["outcomes"].items()}
    return TriedReading(one["reading"], one["changes"], outcomes, one["score"])
