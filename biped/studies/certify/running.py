"""Outcomes of runs in the order in which they are asked for, wherever they are made, with a journal."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.ensemble.backend import Progress, Told
from biped.ensemble.campaign import simulate
from biped.ensemble.executor import Map
from biped.ensemble.folder import Folder
from biped.ensemble.plan import Plan
from biped.scenario.randomise import Normals
from biped.studies.certify.outcome import RunOutcome, Score, outcome_of
from biped.studies.folders import finished


class Request(NamedTuple):
    """A run that is asked for.

    Attributes:
        run: Its seed and the moves that were made from it.
        score: What rises in it; None: nothing does.
        learns: Whether its states are recorded.
    """

    run: Normals
    score: Score | None
    learns: bool


class MakingOutcomes:
    """The outcome of a run that has a seed of its own, wherever it is sent to.

    Args:
        plan: The ensemble.
        against: Another plan, whose law meets what this one fell by; default: none.
    """

    def __init__(self, plan: Plan, against: Plan | None = None):
        self._plan, self._against = plan, against

    def __call__(self, request: Request) -> RunOutcome:
        """Makes the run."""
        seed = request.run
        run = Normals(int(seed), seed.moves)
        with np.errstate(all="ignore"):
            trajectory, duration = simulate(self._plan.run_from(run)), self._plan.scenario.duration
            outcome = outcome_of(trajectory, request.score, duration, since_of(run) if request.learns else math.inf)
            stands = not outcome.fell or self._against is None or simulate(self._against.run_from(seed)).end != "fell"
        return outcome._replace(squares=round(run.squares, 6), stands=stands)


def since_of(run: Normals) -> float:
    """[s] from which a score may be learned from a run: from where it branched off.

    A branch's past was chosen for reaching a level, and all of a run that was only mixed resembles one that was chosen.
    """
    if not run.moves:
        return 0.0
    last = run.moves[-1]
    return last.after if last.beta == 1.0 else 0.0 if multiplied(run) else math.inf


def multiplied(run: Normals) -> bool:
    """Whether a run's last move multiplies its normals: its force is not as strong as the scenario's."""
    return bool(run.moves) and run.moves[-1].beta == 0.0 and run.moves[-1].keep != 1.0


class Outcomes:
    """Outcomes of runs in the order in which they are asked for, those that were noted without being made again.

    Args:
        carried_out: Makes runs.
        noted: Outcomes of an earlier, interrupted command.
        note: Called with the number of a run and its outcome.
        advance: Called for every run.
        score: What rises in them; None: what is learned of their states.

    Attributes:
        runs: How many were asked for.
        score: As given, until it is learned.
        learns: Whether their states are recorded.
        states: Those that were.
        fell: Runs that fell by a force as strong as the scenario's, however they were chosen, with their outcomes.
    """

    def __init__(self, carried_out: Callable[[Iterator[Request]], Iterator[RunOutcome]], noted: dict[int, RunOutcome],
                 note: Callable[[int, RunOutcome], RunOutcome], advance: Callable[..., None],
                 score: Score | None = None):  # fmt: skip
        self._carried_out, self._noted, self._note, self._advance = carried_out, noted, note, advance
        self.runs, self.score, self.learns = 0, score, score is None
        self.states: list[tuple[float, ...]] = []
        self.fell: list[tuple[Normals, RunOutcome]] = []

    def __call__(self, seeds: Sequence[Normals]) -> list[RunOutcome]:
        """The outcomes of runs."""
        numbers = range(self.runs, self.runs + len(seeds))
        self.runs += len(seeds)
        missing = [number for number in numbers if number not in self._noted]
        made = self._carried_out(Request(seeds[number - numbers.start], self.score, self.learns) for number in missing)
        for number, outcome in zip(missing, made, strict=True):
            self._noted[number] = self._note(number, outcome)
            self._advance()
        found = [self._noted.pop(number) for number in numbers]
        self.states += [state for outcome in found for state in outcome.states]
        found = [outcome._replace(states=()) for outcome in found]
        self.fell += [(run, one) for run, one in zip(seeds, found, strict=True) if one.fell and not multiplied(run)]
        return found

    def plain(self, rng: np.random.Generator, count: int) -> list[tuple[Normals, RunOutcome]]:
        """Runs that nothing selects, with their outcomes."""
        runs = [Normals(int(rng.integers(2**62))) for _ in range(count)]
        return list(zip(runs, self(runs), strict=True))

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


def journalled(folder: Folder, carried_out: Map[Request, RunOutcome], settings: dict[str, Any], most: int,
               progress: Progress, title: str, tell: Told,
               score: Score | None = None) -> tuple[Outcomes, Any]:  # fmt: skip
    """Outcomes with a journal in a folder, and what ends the progress that is shown.

    Raises:
        InputError: The journal was begun with other settings.
    """
    records = finished(folder, tell)
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
    return Outcomes(partial(carried_out, ordered=True), noted, note, advance, score), stack


def _read(record: dict[str, Any]) -> RunOutcome:
    rises = tuple((float(time), int(which), float(value)) for time, which, value in record["rises"])
    return RunOutcome(bool(record["fell"]), float(record["end"]), rises, int(record["steps"]), str(record["other"]),
                      str(record["way"]), float(record["squares"]), bool(record["stands"]),
                      tuple(map(tuple, record["states"])))  # fmt: skip
