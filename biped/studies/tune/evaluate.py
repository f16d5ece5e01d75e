"""The cost of a candidate of a search: runs of every condition, on seeds that all candidates share."""

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
from biped.measure.metrics.walking import STILL
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.gains import Gains
from biped.scenario.goals import Condition, Tune
from biped.scenario.keys import Scenario, Window
from biped.scenario.reading import changed
from biped.scenario.transitions import TRANSITIONS, transitions_of
from biped.scenario.vary import ChangeOrigin, stream, with_values
from biped.studies.stability.orbit import parting
from biped.studies.tune.search_space import Candidate

PLANS = 64
"""Most plans kept at a time; each holds its robot, some 50 MB. Those of an earlier seed are never needed again."""

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
            if condition.growth is not None and condition.goal != "walked":
                raise InputError(f"tune.conditions.{name}.growth: expected none: neighbours are those of a "
                                 "walk")  # fmt: skip
            for full in (True, False):
                Plan(self.condition(name, full))

    def __reduce__(self) -> tuple[Any, ...]:
        return Study, (self.scenario,)  # made anew wherever it is sent

    @property
    def gains(self) -> Gains:
        """The gait that the search starts at, complete: the run's first one, or that of the change whose gains vary."""
        return begun_with(self.base, self.tune.change)

    @property
    def gait(self) -> str:
        """Name of that gait."""
        if self.tune.change is None:
            return self.scenario.controller
        change = self.scenario.change[self.tune.change]
        return change.controller or getattr(transitions_of(self.scenario.controller), change.to or "stand")

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
            whole = changed(base, changes, where)
            _changes(whole, self.tune.change, f"{where}: change")
            self._scenarios[name, full] = whole
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
        for name, most in (self.tune.limits if condition.limits is None else condition.limits).items():
            if math.isfinite(numbers[name]):  # a stander has no cost of transport
                cost += weights.excess * max(0.0, numbers[name] / most - 1.0)
        for name, least in (self.tune.floors if condition.floors is None else condition.floors).items():
            if math.isfinite(numbers[name]):
                cost += weights.excess * max(0.0, 1.0 - numbers[name] / least)
        if condition.growth is not None:
            grown = parting(run, walk)  # infinite: as costly as a walk can be
            cost += weights.excess * max(0.0, grown - condition.growth)
        return below(cost, 0.5 * weights.falls) if weights.falls > 0.0 else cost

    def _missed(self, numbers: Mapping[str, Any], condition: Condition, run: Run) -> float:
        """The cost of a run that failed: less, the longer it stayed up and, if it should walk, the further it came."""
        return self.tune.weights.falls * (1.0 - 0.5 * earned(numbers, self.tune, run, condition.goal))

    def _run(self, task: Task) -> Run:
        """The task's run; its draws do not depend on the gait, so plans are shared between candidates."""
        origin, drawn = ChangeOrigin("tune.keys"), self.condition(task.condition, task.full).randomise.draw
        late = {name: value for name, value in task.candidate.keys if name.startswith(_LATE) and name not in drawn}
        early = tuple(one for one in task.candidate.keys if one[0] not in late)
        key = task.condition, task.full, task.seed, early
        if key not in self._plans:
            if len(self._plans) >= PLANS or any(seed != task.seed for _, _, seed, _ in self._plans):
                self._plans.clear()
            scenario = with_values(self.condition(task.condition, task.full), dict(early), origin)
            random = msgspec.structs.replace(scenario.randomise, runs=RUNS)
            self._plans[key] = Plan(msgspec.structs.replace(scenario, seed=task.seed, randomise=random), checked=True)
        run = self._plans[key].run(task.number)
        scenario, gains = with_values(run.scenario, late, origin), task.candidate.gains
        if self.tune.change is not None:
            return replace(run, scenario=with_gait(scenario, self.tune.change, gains))
        return replace(run, gains=gains, scenario=scenario)

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


def below(cost: float, most: float) -> float:
    """The cost of a walk, bent below a bound: however slow or costly it is, it is never worse than a fall.

    Up to half the bound it is the cost itself. Beyond, it grows ever more slowly, so that of two walks that are far
    from what is wanted the better one still costs less.

    Args:
        cost: Without the bound.
        most: The bound.
    """
    return cost if cost <= 0.5 * most else most * (1.0 - 0.25 * most / cost)


def earned(numbers: Mapping[str, Any], tune: Tune, run: Run, goal: str) -> float:
    """The share of its goal that a run which misses it has earned: by time, and by distance or by stillness.

    Args:
        numbers: Its metrics.
        tune: The search that asks.
        run: The run.
        goal: What it should do.
    """
    if numbers["diverged"]:
        return 0.0  # where numbers blew up it came some thousand kilometres
    seconds = run.scenario.duration
    upright = min(1.0, numbers["time"] / seconds)
    if goal != "walked":
        strayed, steps = numbers["strayed"], numbers["steps"]
        still = min(1.0, STILL / strayed) / (1.0 + steps) if math.isfinite(strayed) and strayed > 0.0 else 0.0
        return (1.0 - tune.weights.stillness) * upright + tune.weights.stillness * still
    # Who falls forward once has come as far as the slowest walk goes in some seconds.
    far = max(0.0, numbers["distance"]) / ((tune.pace or run.robot.walked.speed) * seconds)
    return (1.0 - tune.weights.progress) * upright + tune.weights.progress * min(1.0, far)


def begun_with(scenario: Scenario, change: int | None) -> Gains:
    """The complete gait that a scenario without a search begins with, or that one of its changes goes over to."""
    _changes(scenario, change, "tune.change")
    run = Plan(scenario).run(0)
    return run.gains if change is None else run.scenario.change[change].gains


def with_gait(scenario: Scenario, change: int | None, gains: Gains) -> Scenario:
    """A scenario with another gait, as its own or as that of one of its changes."""
    if change is None:
        return msgspec.structs.replace(scenario, gains=gains)
    changes = list(scenario.change)
    changes[change] = msgspec.structs.replace(changes[change], gains=gains)
    return msgspec.structs.replace(scenario, change=tuple(changes))


def _changes(scenario: Scenario, number: int | None, key: str) -> None:
    """Makes sure that a scenario has a change of that number, which goes over to a gait.

    Raises:
        InputError: It has none.
    """
    if number is None:
        return
    change = scenario.change[number] if number < len(scenario.change) else None
    if change is None or (change.controller is None and change.to not in TRANSITIONS):
        raise InputError(f"{key}: expected a change {number} that names a gait (controller, or to = "
                         f"{' or '.join(TRANSITIONS)}), as tune.change asks for", key)  # fmt: skip


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
