"""`biped find`: distinct ways to fall, the likeliest first, each a scenario that is run again by itself.

A run that fell is made likelier, as long as it falls in the same way: what is left is what it takes to fall. The
likelihood of a run is that of the normals that it draws, exp(−|z|²/2): the likeliest draws zeros. Parts of z are set to
zero, large ones first, then all of it shrinks, and what does not make the run fall any more is taken back: delta
debugging (A. Zeller, R. Hildebrandt, IEEE Trans. Softw. Eng. 28:183, 2002) on a run's random numbers. What it finds is
a local optimum.
"""

from collections.abc import Generator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.writing import dumps
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.executor import workers
from biped.ensemble.guard import OF_RUNS
from biped.ensemble.plan import Plan
from biped.scenario.goals import Bound
from biped.scenario.keys import Scenario
from biped.scenario.randomise import Move, Normals
from biped.scenario.reading import to_toml
from biped.scenario.vary import piece_normals, piece_times, stream
from biped.studies.certify import check_random, process_of
from biped.studies.certify.estimation import FIRST, LEAST_SIZE, Accuracy, levels_of
from biped.studies.certify.outcome import RunOutcome
from biped.studies.certify.running import MakingOutcomes, Outcomes, journalled
from biped.studies.certify.shifting import Learner
from biped.studies.certify.splitting import EARLIEST, Member, Moving, cost_of, sampled
from biped.studies.folders import folder_for
from biped.studies.run import plan_of, title_of

ENOUGH = 5
"""Falls among plain runs from which no more than plain runs are made."""
SIZE = 50
"""Runs at each level: a search wants many falls of many origins, not a number."""
LEARNING = 0.6
"""Share of the runs in which patterns may be learned at most."""
LAST = 1.0
"""[s] before a fall in which falls are compared."""


class Failure(NamedTuple):
    """A way to fall.

    Attributes:
        way: In words.
        squares: Sum of the squares of the normals that it takes: less is likelier.
        before: The same of the run as it was found.
        end: [s] when it fell.
        file: The scenario that makes it again.
    """

    way: str
    squares: float
    before: float
    end: float
    file: Path


class Failures(NamedTuple):
    """Ways to fall.

    Attributes:
        scenario: Name of the scenario.
        against: What stood where this fell; None where nothing was compared.
        folder: Where their scenarios are.
        runs: How many were made.
        plain: How many of them nothing selected.
        falls: How many of those fell.
        distinct: Falls no two of which share half of the random force of the last second, however they were found.
        cells: In how many ways, at how many steps, they fell: pairs of both.
        found: The failures, the likeliest first.
    """

    scenario: str
    against: str | None
    folder: Path
    runs: int
    plain: int
    falls: int
    distinct: int
    cells: int
    found: tuple[Failure, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it and find.json holds it."""
        found = [one._asdict() | {"file": label(one.file)} for one in self.found]
        return self._asdict() | {"folder": label(self.folder), "found": found}


def find(
    name: str, changes: Sequence[str], against: str | None, jobs: Jobs, out: Path | None, failures: int = 10,
    most: int = 3000, progress: Progress = silent, tell: Told = unheard,
) -> Failures:  # fmt: skip
    """Finds distinct ways in which a scenario's runs fall; goes on where an interrupted command in `out` stopped.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        against: `--set` change that the other law has, which is to stand: a gait or a law; default: none.
        jobs: Number of processes, or a cluster.
        out: Results folder; default: a new one below runs/.
        failures: Most ways to fall.
        most: Runs at most, before falls are made plain.
        progress: Told of every finished run.
        tell: Told what of an interrupted command could not be used.

    Raises:
        InputError: The scenario has nothing random, or nothing fell.
    """
    plan = plan_of(name, changes)
    other = None if against is None else plan_of(name, [*changes, against])
    accuracy = Accuracy(most=most, size=SIZE)
    check_random(plan)
    if failures < 1:
        raise InputError(f"--failures {failures}: expected at least 1")
    if most < FIRST:
        raise InputError(f"--most {most}: expected at least {FIRST} runs")
    title = title_of(name)
    with folder_for(out, title, plan, foreign=OF_RUNS) as folder, \
            workers(MakingOutcomes(plan, other), jobs) as carried_out:  # fmt: skip
        outcomes, closing = journalled(folder, carried_out, {"find": True, "against": against, "most": most}, most,
                                       progress, title, tell)  # fmt: skip
        with closing:
            plain, fell = _fallen(plan, outcomes, accuracy, failures)
            chosen = _likeliest(fell, failures)
            apart = distinct(plan.scenario, fell)
            cells = {(outcome.way, outcome.steps) for _, outcome in apart}
            ends = outcomes.finish([plainer(one, plan.scenario.duration) for one in chosen]) if chosen else []
        order = sorted(range(len(ends)), key=lambda i: ends[i][1].squares)
        found = []
        for number, i in enumerate(order, 1):
            (run, outcome), file = ends[i], f"failure-{number}.toml"
            folder.save_text(file, _scenario(plan, title, number, run, outcome.way))
            found.append(
                Failure(outcome.way, outcome.squares, chosen[i][1].squares, outcome.end, folder.path / file)
            )  # fmt: skip
        falls = sum(outcome.fell for _, outcome in plain)
        result = Failures(
            title, against, folder.path, outcomes.runs, len(plain), falls, len(apart), len(cells), tuple(found)
        )
        folder.save_text("find.json", dumps(result.as_dict(), indent=1))
    return result


def _fallen(plan: Plan, outcomes: Outcomes, accuracy: Accuracy, ways: int) -> tuple[list[Member], list[Member]]:
    """Plain runs, and runs that fell while the other law stood, until there are so many ways or runs run out.

    Where falls are rare, the random force is shifted towards them; where nothing can be shifted, runs are split.
    """
    seed, process = plan.scenario.seed, process_of(plan)
    plain = outcomes.plain(stream(seed, "find.plain"), FIRST)

    def fell() -> list[Member]:
        return [one for one in outcomes.fell if one[1].stands]

    def left() -> int:
        return accuracy.most - outcomes.runs if len({outcome.way for _, outcome in fell()}) < ways else 0

    rare, learned = len(fell()) < ENOUGH, False
    if rare and process is not None:
        learns, outcomes.learns = outcomes.learns, False
        rng = stream(seed, "find.shift")
        learner = Learner(process, outcomes, rng)
        learned = learner.learn(int(LEARNING * left())) is not None
        while learned and left():
            mixture = learner.sharpest()
            drawn = mixture.draw(rng, min(FIRST, left()))
            met = zip(drawn, outcomes(drawn), strict=True)
            learner.go_on(mixture, drawn, [run for run, one in met if one.fell and one.stands])
        outcomes.learns = learns and not learned
    moving, number = Moving(tuple(piece_times(plan.scenario).tolist())), 0
    levels = levels_of(seed, outcomes, plain, moving, accuracy) if rare and not learned else None
    while left():
        if levels is None or cost_of(levels, LEAST_SIZE, moving) > left():
            plain = plain + outcomes.plain(stream(seed, f"find.plain.{number}"), min(FIRST, left()))
        else:
            size = accuracy.size
            while cost_of(levels, size, moving) > left():
                size -= 1
            outcomes.finish([sampled(seed, number, size, levels, moving)])
        number += 1
    return plain, fell()


def distinct(scenario: Scenario, fell: Sequence[Member]) -> list[Member]:
    """Falls no two of which share half of the random force of the last second before them; without one, all of them.

    What splitting copies falls again in much the same way, and does not count; falls among plain runs share nothing.
    """
    times = piece_times(scenario)
    if scenario.disturbance is None:
        return list(fell)
    kept: list[Member] = []
    drawn: list[np.ndarray] = []
    for run, outcome in fell:
        z = piece_normals(scenario, Normals(int(run), run.moves))
        rows = (times >= outcome.end - LAST) & (times < outcome.end)
        if all(np.mean(np.all(z[rows] == other[rows], axis=1)) < 0.5 for other in drawn):
            kept.append((run, outcome))
            drawn.append(z)
    return kept


def _likeliest(fell: Sequence[Member], most: int) -> list[Member]:
    """Of every way to fall the likeliest run; the likeliest ways first."""
    likeliest: dict[str, Member] = {}
    for one in sorted(fell, key=lambda member: member[1].squares):
        likeliest.setdefault(one[1].way, one)
    return list(likeliest.values())[:most]


def _scenario(plan: Plan, title: str, number: int, run: Normals, way: str) -> str:
    """The scenario of one run that fell, in which it is expected to stand."""
    s = plan.scenario
    randomise = replace(s.randomise, runs=1, moves=(Move(seed=int(run)), *run.moves))
    falls = Bound(max=0)
    return to_toml(
        replace(s, description=f"{title}, failure {number}: fell {way}", randomise=randomise, expect={"falls": falls})
    )


HALVINGS = 4
"""Of the run's duration: lengths of the parts that are set to zero."""
SHRINKS = (0.5, 0.7, 0.85, 0.95)
"""By which all of the normals are multiplied in turn."""


def plainer(first: Member, duration: float) -> Generator[list[Normals], list[RunOutcome], Member]:
    """Makes a run that fell likelier.

    Args:
        first: The run.
        duration: [s] of a run.

    Returns:
        The likeliest run on the way that fell as the first did, while the law that it is compared with stood.
    """
    best, outcome = first
    for move in _moves(outcome.end, duration):
        tried = best.moved(move)
        (met,) = yield [tried]
        if met.fell and met.stands and met.way == outcome.way and met.squares < outcome.squares:
            best, outcome = tried, met
    return best, outcome


def _moves(end: float, duration: float) -> list[Move]:
    none = Move(beta=0.0, keep=0.0, before=0.0)  # of what no time belongs to
    moves = [Move(beta=0.0, keep=0.0, after=max(end, EARLIEST)), none] if end < duration else [none]
    for halving in range(1, HALVINGS + 1):
        width = end / 2**halving
        moves += [
            Move(beta=0.0, keep=0.0, after=max(part * width, EARLIEST), before=(part + 1) * width)
            for part in range(2**halving)
        ]
    return [*moves, *(Move(beta=0.0, keep=share) for share in SHRINKS)]
