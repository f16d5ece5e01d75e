"""`biped certify`: how likely a scenario's fall is, by counting or by splitting, whichever is cheaper."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.base.json import dumps
from biped.base.progress import Progress, Told, silent, unheard
from biped.ensemble.backend import Jobs
from biped.ensemble.campaign import simulate
from biped.ensemble.executor import Map, workers
from biped.ensemble.folder import Folder
from biped.ensemble.guard import OF_RUNS
from biped.ensemble.plan import Plan
from biped.scenario.disturbed import piece_times
from biped.scenario.normals import Normals
from biped.scenario.vary import stream
from biped.studies.certify.estimate import LEAST_SAMPLES, Probability, combined, counted, plain_is_cheaper
from biped.studies.certify.precursors import SCORES, RunOutcome, outcome_of
from biped.studies.certify.splitting import (
    MOVES,
    SHARE,
    Levels,
    Moving,
    Sample,
    baseline_of,
    least_scatter,
    pilot,
    sampled,
)
from biped.studies.folders import folder_for
from biped.studies.planned import plan_of, title_of

COUNTING, SPLITTING = "counting", "splitting"
FIRST = 200
"""Plain runs that decide between counting and splitting."""
WAVE = 5
"""Samples that are drawn side by side."""
LEAST_FALLS = 10
"""Falls from which a count ends."""


class Accuracy(NamedTuple):
    """When to stop.

    Attributes:
        relative: Half the 95 % interval over the probability.
        most: Runs at most.
        size: Runs at each level of a sample.
        score: Of `SCORES`.
        method: `COUNTING` or `SPLITTING`; None: whichever is cheaper.
    """

    relative: float = 0.3
    most: int = 100_000
    size: int = 150
    score: str = "margin"
    method: str | None = None


class Certified(NamedTuple):
    """How likely a fall is.

    Attributes:
        scenario: Its name.
        folder: Where it is written.
        duration: [s] of a run.
        method: `COUNTING` or `SPLITTING`.
        score: What levels are of.
        probability: Of a fall within the duration.
        reached: Whether the interval is as narrow as asked for.
        runs: How many were made, all told.
        plain: How many of them nothing selected.
        falls: How many of those fell.
        steps: Mean number of foot strikes of a plain run.
        seconds: [s] mean time of a plain run.
        levels: Of the score; a fall is above them.
        shares: Of the runs that reached each level, and at last a fall: means of all samples.
        estimates: Of the samples.
        other: Plain runs that neither fell nor were completed.
        fell: Some runs that fell, with their outcomes.
        doubt: What speaks against the result, if anything.
    """

    scenario: str
    folder: Path
    duration: float
    method: str
    score: str
    probability: Probability
    reached: bool
    runs: int
    plain: int
    falls: int
    steps: float
    seconds: float
    levels: tuple[float, ...]
    shares: tuple[float, ...]
    estimates: tuple[float, ...]
    other: int
    fell: tuple[tuple[Normals, RunOutcome], ...]
    doubt: str

    def per(self, steps: float) -> Probability:
        """The probability of a fall within so many steps, each as dangerous as any other."""
        times = steps / self.steps if self.steps > 0.0 else math.nan
        return Probability(*(-math.expm1(times * math.log1p(-min(one, 1.0 - 1e-16))) for one in self.probability))

    @property
    def steps_to_fall(self) -> Probability:
        """Mean number of steps to a fall, each as dangerous as any other (metastable walking, Byl & Tedrake 2009)."""
        value, low, high = (
            self.steps / -math.log1p(-one) if 0.0 < one < 1.0 else math.inf if one == 0.0 else self.steps
            for one in self.probability
        )
        return Probability(value, high, low)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it and certify.json holds it."""
        return {
            "scenario": self.scenario, "folder": label(self.folder), "duration": self.duration, "method": self.method,
            "score": self.score, "probability": self.probability.value,
            "interval": [self.probability.low, self.probability.high], "reached": self.reached, "runs": self.runs,
            "plain": {"runs": self.plain, "falls": self.falls, "interval": list(counted(self.falls, self.plain)[1:]),
                      "steps": self.steps, "seconds": self.seconds, "other": self.other},
            "per_100_steps": list(self.per(100.0)), "steps_to_fall": list(self.steps_to_fall),
            "levels": list(self.levels), "shares": list(self.shares), "estimates": list(self.estimates),
            "doubt": self.doubt,
        }  # fmt: skip


class MakingOutcomes:
    """The outcome of a run that has a seed of its own, wherever it is sent to.

    Args:
        plan: The ensemble.
        score: Of `SCORES`.
        against: Another plan, whose law meets what this one fell by; default: none.
    """

    def __init__(self, plan: Plan, score: str, against: Plan | None = None):
        self._plan, self._score, self._against = plan, score, against

    def __call__(self, seed: Normals) -> RunOutcome:
        """Makes the run."""
        run = Normals(int(seed), seed.moves)
        with np.errstate(all="ignore"):
            outcome = outcome_of(simulate(self._plan.run_from(run)), self._score)
            stands = not outcome.fell or self._against is None or simulate(self._against.run_from(seed)).end != "fell"
        return outcome._replace(squares=round(run.squares, 6), stands=stands)


class Outcomes:
    """Outcomes of runs in the order in which they are asked for, those that were noted without being made again.

    Args:
        carried_out: Makes runs.
        noted: Outcomes of an earlier, interrupted command.
        note: Called with the number of a run and its outcome.
        advance: Called for every run.
    """

    def __init__(self, carried_out: Callable[[Iterator[Normals]], Iterator[RunOutcome]], noted: dict[int, RunOutcome],
                 note: Callable[[int, RunOutcome], RunOutcome], advance: Callable[..., None]):  # fmt: skip
        self._carried_out, self._noted, self._note, self._advance = carried_out, noted, note, advance
        self.runs = 0

    def __call__(self, seeds: Sequence[Normals]) -> list[RunOutcome]:
        """The outcomes of runs."""
        numbers = range(self.runs, self.runs + len(seeds))
        self.runs += len(seeds)
        missing = [number for number in numbers if number not in self._noted]
        made = self._carried_out(iter([seeds[number - numbers.start] for number in missing]))
        for number, outcome in zip(missing, made, strict=True):
            self._noted[number] = self._note(number, outcome)
            self._advance()
        return [self._noted.pop(number) for number in numbers]

    def finish(self, samplings: Sequence[Any]) -> list[Any]:
        """Carries out several samplings side by side; returns what each returns."""
        found: dict[int, Any] = {}
        wanted: dict[int, list[Normals]] = {}

        def go_on(i: int, outcomes: list[RunOutcome] | None) -> None:
            try:
                wanted[i] = samplings[i].send(outcomes)
            except StopIteration as stop:
                found[i] = stop.value

        for i in range(len(samplings)):
            go_on(i, None)
        while wanted:
            outcomes = iter(self([seed for i in sorted(wanted) for seed in wanted[i]]))
            for i in sorted(wanted):
                go_on(i, list(islice(outcomes, len(wanted.pop(i)))))
        return [found[i] for i in range(len(samplings))]


def certify(
    name: str, changes: Sequence[str], jobs: Jobs, out: Path | None, accuracy: Accuracy = Accuracy(),  # noqa: B008
    progress: Progress = silent, tell: Told = unheard,
) -> Certified:  # fmt: skip
    """How likely a fall of a scenario's run is; goes on where an interrupted command in `out` stopped.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.
        out: Results folder; default: a new one below runs/.
        accuracy: When to stop.
        progress: Told of every finished run.
        tell: Told what of an interrupted command could not be used.

    Raises:
        InputError: The scenario has nothing random, or has a sweep, or nothing fell in plain runs and in no level.
    """
    plan = plan_of(name, changes)
    _check(plan, accuracy)
    title = title_of(name)
    with folder_for(out, title, plan, foreign=OF_RUNS) as folder, \
            workers(MakingOutcomes(plan, accuracy.score), jobs) as carried_out:  # fmt: skip
        settings = {"size": accuracy.size, "score": accuracy.score, "method": accuracy.method}
        outcomes, closing = journalled(folder, carried_out, settings, accuracy.most, progress, title, tell)
        with closing:
            found = estimated(plan.scenario.seed, outcomes, Moving(tuple(piece_times(plan.scenario))), accuracy)
        certified = _certified(title, folder.path, plan.scenario.duration, accuracy, outcomes.runs, found)
        folder.save_text("certify.json", dumps(certified.as_dict(), indent=1))
    return certified


class Found(NamedTuple):
    """An estimate, and what it was made from.

    Attributes:
        probability: The estimate.
        reached: Whether its interval is as narrow as asked for.
        plain: Outcomes of runs that nothing selected.
        samples: Through all levels; none of a count.
        levels: Of the samples.
        fell: Runs that fell.
        doubt: What speaks against it.
    """

    probability: Probability
    reached: bool
    plain: Sequence[RunOutcome]
    samples: Sequence[Sample]
    levels: Levels | None
    fell: Sequence[tuple[Normals, RunOutcome]]
    doubt: str


def estimated(seed: int, outcomes: Outcomes, moving: Moving, accuracy: Accuracy) -> Found:
    """Estimates the probability of a fall.

    Args:
        seed: Of everything random in it.
        outcomes: Of runs.
        moving: How runs are moved.
        accuracy: When to stop.
    """
    rng = stream(seed, "certify.plain")
    first = plain_sample(rng, outcomes, min(FIRST, accuracy.most))
    falls = sum(outcome.fell for _, outcome in first)
    method = accuracy.method
    if method is None:
        method = COUNTING if plain_is_cheaper(falls, len(first), SHARE) else SPLITTING
    if method == COUNTING:
        return _counting(rng, outcomes, first, accuracy, "")
    numbers = 1 + max((which for _, outcome in first for _, which, _ in outcome.rises), default=0)
    baseline = baseline_of([outcome for _, outcome in first], numbers)
    (levels,) = outcomes.finish([pilot(seed, first, baseline, moving, accuracy.most - outcomes.runs)])
    if levels is None:
        doubt = f"the score '{accuracy.score}' stopped rising before runs fell, or --most is too few: runs were counted"
        return _counting(rng, outcomes, first, accuracy, doubt)
    return _splitting(seed, outcomes, levels, moving, accuracy)


def plain_sample(rng: np.random.Generator, outcomes: Outcomes, count: int) -> list[tuple[Normals, RunOutcome]]:
    """Runs that nothing selects, with their outcomes."""
    runs = [Normals(int(rng.integers(2**62))) for _ in range(count)]
    return list(zip(runs, outcomes(runs), strict=True))


def _counting(rng: np.random.Generator, outcomes: Outcomes, first: list[tuple[Normals, RunOutcome]], accuracy: Accuracy,
              doubt: str) -> Found:  # fmt: skip
    """Counts plain runs until the interval is narrow, looking whenever there are half as many again."""
    sample = list(first)
    while True:
        falls = sum(outcome.fell for _, outcome in sample)
        found = counted(falls, len(sample))
        reached = falls >= LEAST_FALLS and found.relative <= accuracy.relative
        left = accuracy.most - outcomes.runs
        if reached or left <= 0:
            fell = [one for one in sample if one[1].fell]
            return Found(found, reached, [outcome for _, outcome in sample], (), None, fell, doubt)
        sample += plain_sample(rng, outcomes, min(left, max(FIRST, len(sample) // 2)))


def _splitting(seed: int, outcomes: Outcomes, levels: Levels, moving: Moving, accuracy: Accuracy) -> Found:
    samples: list[Sample] = []
    cost = accuracy.size * (1 + MOVES * len(levels.values))
    while True:
        number = len(samples)
        wave = range(number, number + WAVE)
        samples += outcomes.finish([sampled(seed, i, accuracy.size, levels, moving) for i in wave])
        found = combined([sample.probability for sample in samples], least_scatter(samples, accuracy.size))
        reached = len(samples) >= 2 * LEAST_SAMPLES and found.relative <= accuracy.relative
        if reached or outcomes.runs + WAVE * cost > accuracy.most:
            break
    plain = [outcome for sample in samples for outcome in sample.plain]
    fell = [one for sample in samples for one in sample.fell]
    return Found(found, reached, plain, samples, levels, fell, _disagreement(found, plain))


def _disagreement(found: Probability, plain: Sequence[RunOutcome]) -> str:
    """Whether plain runs, in which no level leads anywhere, say something else."""
    falls = sum(outcome.fell for outcome in plain)
    low, high = counted(falls, len(plain))[1:]
    if low > found.high:
        return f"{falls} of the {len(plain)} plain runs fell, more than the levels say: some falls come without them"
    if high < found.low:
        return f"{falls} of the {len(plain)} plain runs fell, fewer than the levels say"
    return ""


def _certified(title: str, path: Path, duration: float, accuracy: Accuracy, runs: int, found: Found) -> Certified:
    shares = [sample.shares for sample in found.samples]
    length = max(map(len, shares), default=0)
    means = tuple(
        float(np.mean([one[i] for one in shares if len(one) > i])) for i in range(length)
    )  # fmt: skip
    plain = found.plain
    return Certified(
        title, path, duration, SPLITTING if found.samples else COUNTING, accuracy.score, found.probability,
        found.reached, runs, len(plain), sum(outcome.fell for outcome in plain),
        float(np.mean([outcome.steps for outcome in plain])), float(np.mean([outcome.end for outcome in plain])),
        found.levels.values if found.levels else (), means, tuple(sample.probability for sample in found.samples),
        sum(bool(outcome.other) for outcome in plain), tuple(found.fell), found.doubt,
    )  # fmt: skip


def journalled(folder: Folder, carried_out: Map[Normals, RunOutcome], settings: dict[str, Any], most: int,
               progress: Progress, title: str, tell: Told) -> tuple[Outcomes, Any]:  # fmt: skip
    """Outcomes with a journal in a folder, and what ends the progress that is shown.

    Raises:
        InputError: The journal was begun with other settings.
    """
    records = {record["index"]: record for record in folder.finished()}
    for words in folder.notes:
        tell(words)
    begun = records.pop(-1, None)
    if begun is not None and begun["settings"] != settings:
        words = ", ".join(f"{key} = {value}" for key, value in begun["settings"].items())
        raise InputError(f"--out {folder.path}: begun with {words}; expected the same, or another folder")
    if begun is None:
        folder.note({"index": -1, "settings": settings})
    noted = {number: _read(record) for number, record in records.items()}

    def note(number: int, outcome: RunOutcome) -> RunOutcome:
        return _read(folder.note({"index": number, **outcome._asdict()}))

    stack = ExitStack()
    advance = stack.enter_context(progress(title, most, len(noted)))
    return Outcomes(partial(carried_out, ordered=True), noted, note, advance), stack


def _read(record: dict[str, Any]) -> RunOutcome:
    rises = tuple((float(time), int(which), float(value)) for time, which, value in record["rises"])
    return RunOutcome(bool(record["fell"]), float(record["end"]), rises, int(record["steps"]), str(record["other"]),
                      str(record["way"]), float(record["squares"]), bool(record["stands"]))  # fmt: skip


def _check(plan: Plan, accuracy: Accuracy) -> None:
    if accuracy.score not in SCORES:
        raise InputError(f"--score {accuracy.score}: unknown score; {nearest(accuracy.score, list(SCORES))}")
    if not 0.0 < accuracy.relative < 10.0:
        raise InputError(
            f"--relative {accuracy.relative:g}: expected half the interval over the probability, such as 0.3"
        )
    if accuracy.size < 20:
        raise InputError(f"--size {accuracy.size}: expected at least 20 runs at each level")
    least = FIRST + 2 * LEAST_SAMPLES * accuracy.size
    if accuracy.most < FIRST:
        raise InputError(f"--most {accuracy.most}: too few runs to say anything; expected at least {FIRST} to count, "
                         f"and some {4 * least} to split")  # fmt: skip
    check_random(plan)


def check_random(plan: Plan) -> None:
    """Makes sure that a scenario has something random, and that all of it is drawn.

    Raises:
        InputError: It has not.
    """
    s = plan.scenario
    if s.sweep:
        raise InputError("sweep: expected none: one question is asked, not one at every point", "sweep")
    for key, draw in s.randomise.draw.items():
        if draw.grid is not None:
            raise InputError(f'randomise.draw."{key}": expected choice, which is random, instead of grid', "randomise")
    random = s.randomise
    sensed = s.sensors.angle_noise or s.sensors.rate_noise or s.sensors.height_noise or s.sensors.zero_error
    if not (random.draw or random.controller_mass_matrix or random.controller_constraints or s.start.jitter
            or s.disturbance or s.ground.tiles.height or sensed or s.sensors.gyro):  # fmt: skip
        raise InputError(
            "nothing random in this scenario: every run is the same; expected [disturbance], [randomise.draw], "
            "start.jitter, ground.tiles or noise of sensors, e.g. --set 'disturbance={force=[40.0,0.0]}'"
        )
