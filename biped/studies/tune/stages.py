"""Stages of a search: what each asks for, where the first may begin, and how one follows on another.

Easy conditions come first, or a gain is led step by step to where a search would not go by itself.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import takewhile
from pathlib import Path
from typing import Any, NamedTuple

from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import canonical, locate, nearest
from biped.ensemble.backend import Jobs, Told
from biped.ensemble.folder import Folder
from biped.scenario.gains import LACKED, Gains, LackedGains, single, with_numbers
from biped.scenario.goals import Stage
from biped.scenario.keys import Scenario
from biped.scenario.reading import changed, read_scenario
from biped.scenario.vary import ChangeOrigin, setting, with_values
from biped.studies.folders import finished
from biped.studies.tune.evaluate import Study, begun_with, with_gait, workers
from biped.studies.tune.search import Record, Search, SearchResult, ended, good_enough
from biped.studies.tune.search_space import Candidate, SearchSpace, key_axis, names_of, varied


def studies(scenario: Scenario) -> list[Study]:
    """The stages of a tuning scenario as searches of their own, all from the scenario's gait.

    Raises:
        InputError: A stage names what does not exist or cannot be run; nothing is left to the stage's own time.
    """
    found = []
    for number, stage in enumerate(_stages(scenario)):
        study = Study(_scenario_of(scenario, number, stage))
        SearchSpace(study.scenario, study.gains)
        found.append(study)
    return found


class Begun(NamedTuple):
    """Where a search goes on from.

    Attributes:
        scenario: Its scenario, with the gait that it began at.
        stages: Its stages from that gait.
        number: The stage that is next.
        candidate: The gait that it begins at; None: the scenario's own.
    """

    scenario: Scenario
    stages: list[Study]
    number: int = 0
    candidate: Candidate | None = None


def beginnings(scenario: Scenario, name: str, changes: Sequence[str]) -> list[Begun]:
    """The places where a scenario's search may begin besides its own gait.

    Args:
        scenario: It.
        name: Its name or path, beside which gaits are looked for too.
        changes: `--set` changes that it was read with.

    Raises:
        InputError: There is no such gait, or the scenario cannot have it.
    """
    found = []
    for i, place in enumerate(scenario.tune.begin if scenario.tune else ()):
        beside = locate("scenarios", name, "scenario").parent
        file = locate("controllers", place.controller, f"tune.begin.{i}.controller", beside)
        more = [setting("controller", canonical("controllers", file))]
        if place.posture is not None:
            more.append(setting("start.posture", place.posture))
        try:
            here = read_scenario(name, [*changes, *more])
            found.append(Begun(here, studies(here)))
        except InputError as error:
            raise InputError(f"tune.begin.{i}: {place.controller}: {error}") from None
    return found


def study_from(scenario: Scenario, number: int, candidate: Candidate) -> Study:
    """Stage `number` (from 0) as a search that starts at a candidate which an earlier stage found."""
    stage = _stages(scenario)[number]
    assert scenario.tune is not None
    whole = with_gait(scenario, scenario.tune.change, candidate.gains)
    found = with_values(whole, dict(candidate.keys), ChangeOrigin("tune.keys"))
    return Study(_scenario_of(found, number, stage))


def _stages(scenario: Scenario) -> tuple[Stage, ...]:
    return (scenario.tune.stages if scenario.tune else ()) or (Stage(),)


def _scenario_of(scenario: Scenario, number: int, stage: Stage) -> Scenario:
    """The scenario of one stage: a tuning scenario without stages."""
    tune = scenario.tune
    if tune is None:
        return scenario  # which is refused where it is studied
    key = f"tune.stages.{number}"
    conditions = tune.conditions
    if stage.conditions is not None:
        for name in stage.conditions:
            if name not in conditions:
                raise InputError(f"{key}.conditions: no condition '{name}'; {nearest(name, list(conditions))}")
        conditions = {name: conditions[name] for name in stage.conditions}
        if not conditions:
            raise InputError(f"{key}.conditions: expected at least one of {', '.join(tune.conditions)}")
    for word in ("controller", "gains", "seed", "sweep", "tune"):
        if word in stage.set:
            raise InputError(f"{key}.set: {word}: expected the same in all stages" if word != "gains" else
                             f"{key}.set: gains: expected in {key}.hold")  # fmt: skip
    if stage.add != LackedGains():
        scenario = with_gait(scenario, tune.change, _added(_begun(scenario), stage, f"{key}.add"))
    names = varied(tune, _begun(scenario))
    part = replace(
        tune,
        stages=(),
        conditions=conditions,
        keys=tune.keys | stage.keys,
        gains=tuple(name for name in names if name not in stage.hold),
        generations=stage.generations or tune.generations,
        spread=stage.spread or tune.spread,
        weights=stage.weights or tune.weights,
        limits=tune.limits if stage.limits is None else stage.limits,
        floors=tune.floors if stage.floors is None else stage.floors,
        checks=stage.checks or tune.checks,
        enough=stage.enough or tune.enough,
    )
    whole = replace(scenario, tune=part)
    if stage.set:
        whole = changed(whole, stage.set, Path(f"{key}.set"))
    before = set(tune.keys).union(*(earlier.keys for earlier in tune.stages[:number]))
    for name, span in stage.keys.items():
        if name not in before:  # what an earlier stage moves may lie elsewhere then
            key_axis(whole, f"{key}.keys", name, span)
    return with_gait(whole, tune.change, _held(Study(whole).gains, stage, key)) if stage.hold else whole


def _begun(scenario: Scenario) -> Gains:
    """The complete gait that the search of a tuning scenario begins with."""
    assert scenario.tune is not None
    return begun_with(replace(scenario, tune=None, sweep={}, expect={}, thesis={}), scenario.tune.change)


def _added(gains: Gains, stage: Stage, key: str) -> Gains:
    """A complete gait with what a stage adds to one that lacks it."""
    if absent := [name for name in stage.add.missing() if name not in LACKED]:
        raise InputError(f"{key}: missing: {', '.join(absent)}")
    return replace(gains, **{name: getattr(stage.add, name) for name in LACKED if getattr(gains, name) is None})


def _held(gains: Gains, stage: Stage, key: str) -> Gains:
    """A complete gait with the values that a stage holds."""
    known = single(names_of(gains))
    for name in stage.hold:
        if name not in known:
            raise InputError(f"{key}.hold: no gain '{name}'; {nearest(name, known)}")
    return with_numbers(gains, stage.hold)


class _Course:
    """Generations of a search so far, and those of an earlier one, which are not made again.

    Args:
        folder: Its own.
        told: Records of the earlier one, in order.
        jobs: Number of processes, or a cluster.
        after: Called after every generation.
        advance: Likewise.
        most: Generations after which the search ends, whatever its stages say.

    Attributes:
        journal: Generations so far.
        made: Runs made now.
    """

    def __init__(
        self, folder: Folder, told: list[Record], jobs: Jobs, after: Callable[[list[Record], Path], None],
        advance: Callable[[], None], most: int,
    ):  # fmt: skip
        self._folder, self._told, self._jobs, self._after, self._advance = folder, told, jobs, after, advance
        self._most = most
        self.journal: list[Record] = []
        self.made = 0

    @property
    def over(self) -> bool:
        """Whether the search is to have no more generations."""
        return len(self.journal) >= self._most

    @contextmanager
    def searched(self, study: Study, continues: bool = False) -> Iterator[Search]:
        """A search to its end; its last comparisons can be made in the block."""
        rest = self._told[len(self.journal) :]
        mine = next((rest[:n] for n in range(len(rest)) if ended(rest[:n], study.tune)), rest)
        with workers(study, self._jobs) as evaluate:
            search = Search(study, evaluate, mine, len(self.journal), continues)
            while not ended(search.journal, study.tune) and len(self.journal) + len(search.journal) < self._most:
                self._folder.note(search.generation())
                self._after(self.journal + search.journal, self._folder.path)
                self._advance()
            self.journal += search.journal
            yield search
            self.made += search.runs


def search_through(
    folder: Folder,
    own: Begun,
    places: list[Begun],
    jobs: Jobs,
    progress: Callable[..., Any],
    after: Callable[[list[Record], Path], None],
    tell: Told,
    most: int | None = None,
) -> tuple[Search, SearchResult, list[Record], int]:
    """Goes through the generations that an earlier search did not finish; returns the journal and the runs made too.

    Args:
        folder: Of the search.
        own: The scenario's own gait.
        places: Others where it may begin.
        jobs: Number of processes, or a cluster.
        progress: Told of every generation.
        after: Called after every generation.
        tell: Told what of an interrupted search could not be used.
        most: Generations after which it ends, whatever its stages say; default: it goes through all.

    Raises:
        InputError: No generation of the last stage up to there was re-checked.
    """
    generations = sum(study.tune.generations for study in own.stages)
    generations += sum(_tried(place).tune.generations for place in places)
    generations = generations if most is None else min(most, generations)
    known = finished(folder, tell)
    # A generation follows from all before it.
    told = [known[number] for number in takewhile(known.__contains__, range(1, generations + 1))]
    with progress(generations, len(told)) as advance:
        course = _Course(folder, told, jobs, after, advance, generations)
        begun = _best_place(course, places) if places else own
        stages, number, candidate = begun.stages, begun.number, begun.candidate
        origin = Candidate(stages[0].gains, ())
        while True:
            study = stages[0] if candidate is None else study_from(begun.scenario, number, candidate)
            with course.searched(study, continues=candidate is not None) as search:
                number = _next(stages, number, search.journal)
                if number == len(stages) or course.over:
                    found = search.finish(None if candidate is None else origin)
                    found, runs = _from_best_posture(search, found, jobs)
                    course.made += runs
                    break
                candidate = search.space.candidate(search.best()[0])
    return search, found, course.journal, course.made


def _from_best_posture(search: Search, found: SearchResult, jobs: Jobs) -> tuple[SearchResult, int]:
    """The result of a last stage from the posture that suits its gait best, and the runs made from others."""
    study, made, least = search.study, 0, None
    check, unseen = (study.seed("posture"), study.tune.checks), (study.seed("unseen"), study.tune.unseen)
    for name, there in postured(study):
        if least is None:
            least, _ = search.score(found.candidate, *check, found.distance)
        with workers(there, jobs) as evaluate:  # one after the other: every pool holds robots of its own
            other = Search(there, evaluate)
            cost, _ = other.score(found.candidate, *check, found.distance)
            if cost < least:
                least = cost
                cost, tallies = other.score(found.candidate, *unseen, found.distance)
                found = found._replace(cost=cost, tallies=tallies, posture=name)
            made += other.runs
    return found, made


def postured(study: Study) -> Iterator[tuple[str, Study]]:
    """A stage from each of the other postures in which its gait may begin.

    Raises:
        InputError: The model has no such posture, or the run does not begin with the gait.
    """
    if study.tune.postures and study.tune.change is not None:
        raise InputError("tune.postures: expected none with tune.change: the gait takes over later in a run")
    for i, name in enumerate(study.tune.postures):
        if name == study.scenario.start.posture:
            continue
        where = f"tune.postures.{i}"
        try:
            there = Study(changed(study.scenario, {"start": {"posture": name}}, Path(where)))
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        yield name, there


def _tried(place: Begun) -> Study:
    """The first stage of a search from one of the places where it may begin, of a few generations."""
    first = place.stages[0]
    assert place.scenario.tune is not None
    tune = replace(first.tune, generations=min(first.tune.generations, place.scenario.tune.tries))
    return Study(replace(first.scenario, tune=tune))


def _best_place(course: _Course, places: list[Begun]) -> Begun:
    """Tries the first stage from every place; the place where a re-check was best, with the gait that it was of.

    The first from which a re-check is good enough for the stage to end is taken at once.
    """
    found = list[tuple[float, Begun]]()
    for place in places:
        with course.searched(tried := _tried(place)) as search:
            best = search.rechecked(1)[0]
            candidate = search.space.candidate(best["mean"])
        here = place._replace(candidate=candidate)
        if good_enough(search.journal, tried.tune):
            after = _next([tried, *place.stages], 0, search.journal) - 1
            return here._replace(number=min(after, len(place.stages) - 1))
        found.append((best["recheck"], here))
    return min(found, key=lambda one: one[0])[1]


def _next(stages: Sequence[Study], number: int, journal: Sequence[Record]) -> int:
    """The stage that follows on one with this journal; a stage that asks for nothing more is passed over."""
    after = number + 1
    while after < len(stages) and _alike(stages[number], stages[after]) and good_enough(journal, stages[after].tune):
        after += 1
    return after


def _alike(one: Study, other: Study) -> bool:
    """Whether two stages put gaits to the same tests."""
    asked = ("conditions", "checks", "duration", "weights", "limits", "floors")
    return one.base == other.base and all(getattr(one.tune, name) == getattr(other.tune, name) for name in asked)
