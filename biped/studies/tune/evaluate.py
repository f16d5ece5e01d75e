"""The score of a candidate: runs of every condition, on all cores, with seeds that all candidates share."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from biped.base.errors import InputError
from biped.ensemble import executor
from biped.ensemble.backend import Jobs
from biped.ensemble.plan import Plan
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario, Window
from biped.scenario.reading import changed
from biped.scenario.tune import Condition, Tune
from biped.scenario.vary import ChangeOrigin, stream, with_values
from biped.studies.stability.orbit import parting
from biped.studies.tune.space import Candidate

PLANS = 64
"""Most plans kept at a time."""

_LATE = "actuation.pushing."
"""Keys that nothing of a run follows from but its law: plans are shared between candidates that differ in them."""

RUNS = 1_000_000
"""More runs than any condition asks for: which of them are made is the search's business."""


class Task(NamedTuple):
    """One run of one candidate.

    Attributes:
        condition: Name of the condition.
        number: Number of the run within it.
        seed: Seed of the ensemble.
        full: Whether the run takes the scenario's own duration, not the search's.
        candidate: Whose run it is.
    """

    condition: str
    number: int
    seed: int
    full: bool
    candidate: Candidate


class GainOutcome(NamedTuple):
    """The cost of one run.

    Attributes:
        cost: Its share of the objective.
        walked: Whether it did what it should, walk or stand.
        speed: [m/s], nan if it fell before the window.
        cost_of_transport: Net; likewise.
    """

    cost: float
    walked: bool
    speed: float
    cost_of_transport: float


class Study:
    """The conditions of a tuning scenario, as scenarios.

    Args:
        scenario: A scenario with a [tune] table.

    Raises:
        InputError: There is none, or a condition cannot be run.
    """

    def __init__(self, scenario: Scenario):
        if scenario.tune is None:
            raise InputError("tune: missing; a scenario to tune says how in a [tune] table (docs/tuning.md)")
        if not scenario.tune.conditions:
            raise InputError("tune.conditions: missing; expected at least one, e.g. [tune.conditions.level]")
        self.tune: Tune = scenario.tune
        self.scenario = scenario
        self.base = msgspec.structs.replace(scenario, tune=None, sweep={}, expect={}, thesis={})
        self._scenarios: dict[tuple[str, bool], Scenario] = {}
        self._plans: dict[tuple[Any, ...], Plan] = {}
        for name, condition in self.tune.conditions.items():
            if condition.growth is not None and (scenario.robot is not None or condition.goal != "walked"):
                raise InputError(f"tune.conditions.{name}.growth: expected none: neighbours are those of a planar "
                                 "biped of seven links that walks")  # fmt: skip
            for full in (True, False):
                Plan(self.condition(name, full))

    def __reduce__(self) -> tuple[Any, ...]:
        return Study, (self.scenario,)  # made anew wherever it is sent

    @property
    def gains(self) -> Gains:
        """The gait that the search starts at, complete."""
        return Plan(self.base).run(0).gains

    def condition(self, name: str, full: bool) -> Scenario:
        """A condition's scenario; short runs (not `full`) have the search's duration and measure its second half."""
        if (name, full) not in self._scenarios:
            base = self.base
            if not full and self.tune.duration is not None:
                base = msgspec.structs.replace(base, duration=self.tune.duration, window=Window())
            where = Path(f"tune.conditions.{name}.set")
            changes = self.tune.conditions[name].set
            for key in ("controller", "gains", "seed", "sweep", "tune"):
                if key in changes:
                    raise InputError(f"{where}: {key}: expected the same in all conditions")
            self._scenarios[name, full] = changed(base, changes, where)
        return self._scenarios[name, full]

    def seed(self, purpose: str, number: int = 0) -> int:
        """The seed of one generation or check: no two purposes share one."""
        return int(stream(self.scenario.seed, f"tune.{purpose}.{number}").integers(2**62))

    def tasks(self, candidate: Candidate, seed: int, full: bool, runs: dict[str, range]) -> list[Task]:
        """The given runs of each condition."""
        return [Task(name, i, seed, full, candidate) for name, numbers in runs.items() for i in numbers]

    def outcome(self, task: Task) -> GainOutcome:
        """Carries out one task."""
        from biped.ensemble.campaign import measured

        run, condition = self._run(task), self.tune.conditions[task.condition]
        walk, numbers = measured(run)
        reached = bool(numbers[condition.goal])
        cost = self._reached(numbers, condition, run, walk) if reached else self._missed(numbers, condition, run)
        return GainOutcome(cost, reached, numbers["speed"], numbers["cost_of_transport"])

    def _reached(self, numbers: Mapping[str, Any], condition: Condition, run: Run, walk: Trajectory) -> float:
        """The cost of a run that did what it should."""
        weights, cost = self.tune.weights, 0.0
        if condition.goal == "walked":
            cost += weights.cost_of_transport * numbers["cost_of_transport"]
            if condition.speed is not None:
                cost += weights.speed * (numbers["speed"] / condition.speed - 1.0) ** 2
        for name, most in self.tune.limits.items():
            if math.isfinite(numbers[name]):  # a stander has no cost of transport
                cost += weights.excess * max(0.0, numbers[name] / most - 1.0)
        if condition.growth is not None:
            grown = parting(run, walk)  # infinite: as costly as a walk can be
            cost += weights.excess * max(0.0, grown - condition.growth)
        # However slow or costly, it is never worse than a fall.
        return min(cost, 0.5 * weights.falls) if weights.falls > 0.0 else cost

    def _missed(self, numbers: Mapping[str, Any], condition: Condition, run: Run) -> float:
        """The cost of a run that failed: less, the longer it stayed up and, if it should walk, the further it came."""
        weights, seconds = self.tune.weights, run.scenario.duration
        earned = min(1.0, numbers["time"] / seconds)
        if condition.goal == "walked":
            # Who falls forward once has come as far as the slowest walk goes in some seconds.
            far = max(0.0, numbers["distance"]) / ((self.tune.pace or run.robot.walked.speed) * seconds)
            earned = (1.0 - weights.progress) * earned + weights.progress * min(1.0, far)
        return weights.falls * (1.0 - 0.5 * earned)

    def _run(self, task: Task) -> Run:
        """The task's run; its draws do not depend on the gait, so plans are shared between candidates."""
        origin, drawn = ChangeOrigin("tune.keys"), self.condition(task.condition, task.full).randomise.draw
        late = {name: value for name, value in task.candidate.keys if name.startswith(_LATE) and name not in drawn}
        early = tuple(one for one in task.candidate.keys if one[0] not in late)
        key = task.condition, task.full, task.seed, early
        if key not in self._plans:
            if len(self._plans) > PLANS:
                self._plans.clear()
            scenario = with_values(self.condition(task.condition, task.full), dict(early), origin)
            random = msgspec.structs.replace(scenario.randomise, runs=RUNS)
            self._plans[key] = Plan(msgspec.structs.replace(scenario, seed=task.seed, randomise=random), checked=True)
        run = self._plans[key].run(task.number)
        return replace(run, gains=task.candidate.gains, scenario=with_values(run.scenario, late, origin))

    def cost(self, outcomes: dict[str, list[GainOutcome]], distance: float) -> float:
        """The objective: weighted mean over conditions of their runs' mean cost, and the distance from the start.

        Args:
            outcomes: By condition.
            distance: Mean square of the candidate's coordinates.
        """
        conditions = self.tune.conditions
        total = sum(conditions[name].weight for name in outcomes)
        mean = sum(
            conditions[name].weight * sum(o.cost for o in found) / len(found) for name, found in outcomes.items()
        )
        return mean / total + self.tune.weights.closeness * distance


def by_condition(tasks: Sequence[Task], outcomes: Sequence[GainOutcome]) -> dict[str, list[GainOutcome]]:
    """Costs of the runs of each condition, in order."""
    found: dict[str, list[GainOutcome]] = {}
    for task, outcome in zip(tasks, outcomes, strict=True):
        found.setdefault(task.condition, []).append(outcome)
    return found


@contextmanager
def workers(study: Study, jobs: Jobs) -> Iterator[Callable[[Sequence[Task]], list[GainOutcome]]]:
    """A function that carries out tasks on `jobs` processes, in their order; the results do not depend on `jobs`."""
    with executor.workers(study.outcome, jobs) as carried_out:
        yield lambda tasks: list(carried_out(tasks))
