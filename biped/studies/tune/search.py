"""The search: CMA-ES on common random numbers, given up early where hopeless, re-checked where promising.

Hansen, "The CMA evolution strategy: a tutorial" (arXiv:1604.00772). Every generation has seeds of its own, which all
its gaits share, so that gaits are compared and not their luck; no gait is ever judged on the seeds that chose it.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from biped.base.errors import InputError
from biped.scenario.goals import Tune
from biped.scenario.vary import stream
from biped.studies.tune.evaluate import GainOutcome, Study, by_condition
from biped.studies.tune.search_space import Candidate, SearchSpace

Evaluate = Callable[[Sequence[Any]], list[GainOutcome]]
Record = dict[str, Any]
"""One generation in the journal: what CMA-ES was told, and the re-check if there was one."""


class Tally(NamedTuple):
    """Counts and costs of the runs of one condition.

    Attributes:
        walked: Runs that walked.
        runs: All runs.
        speed: [m/s] mean of those that walked, nan without any.
        cost_of_transport: Likewise.
    """

    walked: int
    runs: int
    speed: float
    cost_of_transport: float


class SearchResult(NamedTuple):
    """The result of a search.

    Attributes:
        candidate: The gait.
        generation: Whose mean it is.
        cost: Objective on seeds that nothing was decided on.
        tallies: By condition, on the same seeds.
        start_cost: The same for the gait that the search started at.
        start_tallies: Likewise.
        distance: Of the gait from where its search began, as the objective counts it.
        posture: That its runs start from, if another suits it better than the search's own.
    """

    candidate: Candidate
    generation: int
    cost: float
    tallies: dict[str, Tally]
    start_cost: float
    start_tallies: dict[str, Tally]
    distance: float = 0.0
    posture: str | None = None


def strategy(space: SearchSpace, tune: Tune, seed: int):
    """CMA-ES of the `cma` package over the space, starting at its origin.

    Raises:
        InputError: The package is not installed.
    """
    try:
        import cma
    except ImportError:
        raise InputError("tune: needs the package 'cma'; install it with: pip install cma") from None
    rng = stream(seed, "tune.strategy")
    low, high = space.bounds
    options = {
        "bounds": [low, high],
        "popsize": tune.population,
        "CMA_diagonal": tune.covariance == "diagonal",
        "randn": lambda *shape: rng.standard_normal(shape),  # its own stream, not numpy's global one
        "seed": math.nan,
        "verbose": -9,
        "verb_log": 0,
    }
    return cma.CMAEvolutionStrategy(np.zeros(len(space.axes)), tune.spread, options)


class Search:
    """A search that goes on from what a journal already holds.

    Args:
        study: The conditions.
        evaluate: Carries out tasks.
        journal: Generations that an earlier search finished, in order.
        before: Generations of earlier stages.
        continues: Whether an earlier stage found the gait that this one begins with, on which it can fall back.
    """

    def __init__(self, study: Study, evaluate: Evaluate, journal: Sequence[Record] = (), before: int = 0,
                 continues: bool = False):  # fmt: skip
        self.study = study
        self.space = SearchSpace(study.scenario, study.gains)
        self.evaluate = evaluate
        self.runs = 0
        self.before, self.continues = before, continues
        self.journal: list[Record] = []
        self._strategy = strategy(self.space, study.tune, study.scenario.seed)
        for record in journal:
            # The strategy's state follows from what it was told: replaying costs milliseconds and is exact.
            self._update(self._ask(), record)

    def _ask(self) -> list[np.ndarray]:
        return self._strategy.ask()

    def _update(self, points: list[np.ndarray], record: Record) -> None:
        self._strategy.tell(points, record["costs"])
        self.journal.append(record)

    @property
    def mean(self) -> list[float]:
        """The strategy's mean, within bounds: in noise a better answer than the best gait seen."""
        return [float(x) for x in self._strategy.result.xfavorite]

    def generation(self) -> Record:
        """One generation; returns its record, which is in the journal already."""
        tune, mine = self.study.tune, len(self.journal) + 1
        number = self.before + mine
        points = self._ask()
        costs, walked, runs = self._race(points, self.study.seed("generation", number))
        self._strategy.tell(points, costs)
        record: Record = {
            "index": number, "costs": costs, "walked": walked, "runs": runs, "sigma": float(self._strategy.sigma),
        }  # fmt: skip
        if mine % tune.recheck == 0 or mine == tune.generations:
            x = self.mean
            cost, tallies = self._scored(x, self.study.seed("recheck", number), tune.checks)
            record |= {"mean": x, "recheck": cost, "tallies": {name: list(t) for name, t in tallies.items()}}
        self.journal.append(record)
        return record

    def _race(self, points: list[np.ndarray], seed: int) -> tuple[list[float], int, int]:
        """Costs of the points, the worse of which only get the first part of their runs.

        The strategy only ranks: given-up points keep their order, behind all that went on.
        """
        tune, study = self.study.tune, self.study
        first = {name: range(max(1, math.floor(tune.first * c.runs))) for name, c in tune.conditions.items()}
        rest = {name: range(len(first[name]), c.runs) for name, c in tune.conditions.items()}
        found: list[dict[str, list[GainOutcome]]] = [{} for _ in points]
        self._add(found, list(range(len(points))), points, seed, first)
        costs = [study.cost(outcomes, _distance(x)) for outcomes, x in zip(found, points, strict=True)]
        order = sorted(range(len(points)), key=costs.__getitem__)
        kept = order[: max(1, math.ceil(tune.keep * len(points)))]
        given_up = order[len(kept) :]
        self._add(found, kept, points, seed, rest)
        for i in kept:
            costs[i] = study.cost(found[i], _distance(points[i]))
        behind = max(costs[i] for i in kept)
        for i in given_up:
            costs[i] = behind + max(0.0, costs[i] - costs[given_up[0]]) + 1e-9
        outcomes = [o for one in found for group in one.values() for o in group]
        return costs, sum(o.walked for o in outcomes), len(outcomes)

    def _add(
        self, found: list[dict[str, list[GainOutcome]]], which: list[int], points: list[np.ndarray], seed: int,
        runs: dict[str, range],
    ) -> None:  # fmt: skip
        tasks, owners = [], []
        for i in which:
            mine = self.study.tasks(self.space.candidate(points[i]), seed, False, runs)
            tasks += mine
            owners += [i] * len(mine)
        for i, task, outcome in zip(owners, tasks, self.evaluate(tasks), strict=True):
            found[i].setdefault(task.condition, []).append(outcome)
        self.runs += len(tasks)

    def score(
        self, candidate: Candidate, seed: int, runs: int, distance: float = 0.0
    ) -> tuple[float, dict[str, Tally]]:
        """Objective and tallies of full-length runs: at least `runs` of each condition."""
        numbers = {name: range(runs) for name in self.study.tune.conditions}
        tasks = self.study.tasks(candidate, seed, True, numbers)
        found = by_condition(tasks, self.evaluate(tasks))
        self.runs += len(tasks)
        return self.study.cost(found, distance), {name: _tally(group) for name, group in found.items()}

    def _scored(self, x: Sequence[float], seed: int, runs: int) -> tuple[float, dict[str, Tally]]:
        return self.score(self.space.candidate(x), seed, runs, _distance(x))

    def rechecked(self, most: int) -> list[Record]:
        """The generations with the best re-checks, at most so many, the best first.

        Raises:
            InputError: The search ended before the first re-check, and has no gait to fall back on.
        """
        found = sorted((r for r in self.journal if "recheck" in r), key=lambda r: r["recheck"])[:most]
        if not found and not self.continues:
            first = self.before + min(self.study.tune.recheck, self.study.tune.generations)
            raise InputError(f"--generations: expected at least {first}: until then no gait is checked")
        return found

    def best(self) -> tuple[list[float], int]:
        """Compares the best re-checked means, and the gait that it began with, on fresh seeds.

        Returns:
            Coordinates of the winner, and its generation; the beginning, if better, counts as that before the first.

        Raises:
            InputError: There is none.
        """
        tune = self.study.tune
        entrants = [(r["index"], r["mean"]) for r in self.rechecked(tune.finalists)]
        entrants.append((self.before, [0.0] * len(self.space.axes)))
        seed = self.study.seed("final", self.before)
        costs = [self._scored(x, seed, 2 * tune.checks)[0] for _, x in entrants]
        generation, x = entrants[costs.index(min(costs))]  # of equals the first, so the beginning only if it is better
        return x, generation

    def finish(self, start: Candidate | None = None) -> SearchResult:
        """The winner, scored on seeds never used before, beside the gait that it all started at.

        Args:
            start: That gait, if earlier stages have led here.
        """
        x, generation = self.best()
        unseen, runs = self.study.seed("unseen"), self.study.tune.unseen
        cost, tallies = self._scored(x, unseen, runs)
        origin = self.space.candidate([0.0] * len(self.space.axes)) if start is None else start
        same = start is None and not any(x)  # it ended with the gait that it began with
        started, before = (cost, tallies) if same else self.score(origin, unseen, runs)
        return SearchResult(self.space.candidate(x), generation, cost, tallies, started, before, _distance(x))


def ended(journal: Sequence[Record], tune: Tune) -> bool:
    """Whether a stage's generations are over, or its latest re-check was good enough."""
    return len(journal) >= tune.generations or good_enough(journal, tune)


def good_enough(journal: Sequence[Record], tune: Tune) -> bool:
    """Whether the latest generation was re-checked, and well enough for a stage to end."""
    tallies = journal[-1].get("tallies", {}).values() if journal and tune.enough else ()
    return bool(tallies) and all(walked >= (tune.enough or 0.0) * runs for walked, runs, *_ in tallies)


def _distance(x: Sequence[float] | np.ndarray) -> float:
    return float(np.mean(np.square(x)))


def _tally(outcomes: list[GainOutcome]) -> Tally:
    walkers = [o for o in outcomes if o.walked]
    means = [float(np.mean([getattr(o, name) for o in walkers])) if walkers else math.nan
             for name in ("speed", "cost_of_transport")]  # fmt: skip
    return Tally(len(walkers), len(outcomes), *means)
