"""`biped tune`: the gait that a scenario's search finds, what it scores, and a gait file that says how it was found.

A search may have stages: easy conditions first, or a gain led step by step to where a search would not go by itself.
"""

import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any, NamedTuple

from msgspec import to_builtins
from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.base.statistics import wilson
from biped.base.writing import dumps
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.folder import Folder
from biped.ensemble.guard import OF_RUNS
from biped.ensemble.plan import Plan
from biped.scenario.gains import GAINS, NOT_NEEDED, OUT_OF_PLANE, Gains, single, with_numbers
from biped.scenario.gait import GAIT, gait_settings
from biped.scenario.goals import Stage
from biped.scenario.keys import Scenario
from biped.scenario.reading import changed, read_scenario
from biped.scenario.transitions import transitions_of
from biped.scenario.vary import ChangeOrigin, with_values
from biped.studies.folders import finished, folder_for
from biped.studies.run import title_of
from biped.studies.tune.evaluate import Study, begun_with, with_gait, workers
from biped.studies.tune.search import Record, Search, SearchResult, Tally, ended, good_enough, strategy
from biped.studies.tune.search_space import Candidate, SearchSpace, names_of


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
    varied = single(names_of(_begun(scenario)) if tune.gains is None else tune.gains)
    part = replace(
        tune,
        stages=(),
        conditions=conditions,
        gains=tuple(name for name in varied if name not in stage.hold),
        generations=stage.generations or tune.generations,
        spread=stage.spread or tune.spread,
        limits=tune.limits if stage.limits is None else stage.limits,
        floors=tune.floors if stage.floors is None else stage.floors,
        enough=stage.enough or tune.enough,
    )
    whole = replace(scenario, tune=part)
    if stage.set:
        whole = changed(whole, stage.set, Path(f"{key}.set"))
    return with_gait(whole, tune.change, _held(Study(whole).gains, stage, key)) if stage.hold else whole


def _begun(scenario: Scenario) -> Gains:
    """The complete gait that the search of a tuning scenario begins with."""
    assert scenario.tune is not None
    return begun_with(replace(scenario, tune=None, sweep={}, expect={}, thesis={}), scenario.tune.change)


def _held(gains: Gains, stage: Stage, key: str) -> Gains:
    """A complete gait with the values that a stage holds."""
    known = single(names_of(gains))
    for name in stage.hold:
        if name not in known:
            raise InputError(f"{key}.hold: no gain '{name}'; {nearest(name, known)}")
    return with_numbers(gains, stage.hold)


def gait_text(title: str, search: Search, found: SearchResult, journal: Sequence[Record] | None = None) -> str:
    """The gait as a controller file; its head says how it was found and what it scored on unseen seeds.

    Args:
        title: Name of the tuning scenario.
        search: Its last stage.
        found: What that found.
        journal: Generations of all stages; default: the search's own.
    """
    import tomli_w

    study, tune = search.study, search.study.tune
    start = study.gait
    candidate = found.candidate
    journal = search.journal if journal is None else journal
    runs = sum(record["runs"] for record in journal)
    lines = [
        f"Found by `biped tune {title}` with seed {study.scenario.seed}: CMA-ES over {len(search.space.axes)} numbers",
        f"from the gait '{start}', {len(journal)} generations of {tune.population} ({runs} runs); this is the "
        f"mean of generation {found.generation}.",
        f"On {tune.unseen} runs per condition with seeds never used before (walked, 95 % interval; before: {start}):",
        *(_line(name, tally, found.start_tallies[name]) for name, tally in found.tallies.items()),
        f"objective {found.cost:.4f}, before {found.start_cost:.4f}",
    ]
    settings = gait_settings(with_values(study.scenario, dict(candidate.keys), ChangeOrigin("tune.keys")))
    others = [(key, value) for key, value in candidate.keys if key.partition(".")[0] not in GAIT]
    if others:
        lines += ["It was found together with these settings, which a scenario must have:"]
        lines += [f"  {key} = {value:g}" for key, value in others]
    head = "".join(f"# {line}\n" for line in lines)
    if tune.change is None and start:
        named = to_builtins(transitions_of(start))
        settings["transitions"] = {key: value for key, value in named.items() if value is not None}
    data = {
        "description": f"Found by biped tune {title}",
        "source": f"biped tune {title}, seed {study.scenario.seed}",
        **{
            name: _plain(value)
            for name in (*GAINS, *NOT_NEEDED, *OUT_OF_PLANE)
            if (value := getattr(candidate.gains, name)) is not None
        },
        **{name: {key: _plain(value) for key, value in table.items()} for name, table in settings.items()},
    }
    return head + "\n" + tomli_w.dumps(data)


def _plain(value: Any) -> Any:
    """A setting as TOML has it; one that is a table holds all its keys."""
    value = to_builtins(value)
    return list(value) if isinstance(value, tuple) else value


def _line(name: str, tally: Tally, before: Tally) -> str:
    low, high = wilson(tally.walked, tally.runs)
    return (
        f"  {name}: {tally.walked}/{tally.runs} ({low:.0%} – {high:.0%}), {tally.speed:.2f} m/s, "
        f"cost of transport {tally.cost_of_transport:.3f}; before {before.walked}/{before.runs}"
    )


class Tuned(NamedTuple):
    """The result of a search.

    Attributes:
        scenario: Name of the tuning scenario.
        folder: Where it is.
        gait: The gait's file.
        found: Its scores, on seeds never used before.
        keys: Settings of the scenario that the gait was found with.
        runs: Runs made now.
        seconds: Wall time.
        cpu_seconds: Of this process and of those that it began, which have ended.
    """

    scenario: str
    folder: Path
    gait: Path
    found: SearchResult
    keys: dict[str, float]
    runs: int
    seconds: float
    cpu_seconds: float

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        found = self.found
        return {
            "scenario": self.scenario,
            "folder": label(self.folder),
            "gait": label(self.gait),
            "objective": found.cost,
            "before": found.start_cost,
            "conditions": {
                name: tally._asdict() | {"before": found.start_tallies[name]._asdict()}
                for name, tally in found.tallies.items()
            },
            "keys": self.keys,
            "runs": self.runs,
            "cpu_seconds": self.cpu_seconds,
            "runs_per_second": self.runs / self.seconds,
        }


def nothing_after(journal: list[Record], folder: Path) -> None:
    """Does nothing after a generation."""


def tune(
    name: str,
    changes: Sequence[str],
    jobs: Jobs,
    out: Path | None,
    progress: Progress = silent,
    after: Callable[[list[Record], Path], None] = nothing_after,
    tell: Told = unheard,
) -> Tuned:
    """Searches for the gait that a tuning scenario asks for; goes on where an interrupted search in `out` stopped.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.
        out: Results folder; default: a new one below runs/.
        progress: Told of every generation.
        after: Called after every generation with the journal so far and the folder.
        tell: Told what of an interrupted search could not be used.
    """
    scenario = read_scenario(name, changes)
    stages = studies(scenario)  # complaints come before anything is written
    title = title_of(name)
    strategy(SearchSpace(stages[0].scenario, stages[0].gains), stages[0].tune, scenario.seed)
    began, cpu = time.perf_counter(), _cpu()
    with folder_for(out, title, Plan(scenario), foreign=OF_RUNS) as folder:
        search, found, journal, made = _search(folder, scenario, stages, jobs, partial(progress, title), after, tell)
        seconds = time.perf_counter() - began
        path = folder.path / "gait.toml"
        folder.save_text(path.name, gait_text(title, search, found, journal))
        tuned = Tuned(title, folder.path, path, found, dict(found.candidate.keys), made, seconds, _cpu() - cpu)
        folder.save_text("result.json", dumps(tuned.as_dict(), indent=1))
    return tuned


def _cpu() -> float:
    """[s] of this process and of its children that have ended."""
    return sum(os.times()[:4])


def _search(
    folder: Folder,
    scenario: Scenario,
    stages: list[Study],
    jobs: Jobs,
    progress: Callable[..., Any],
    after: Callable[[list[Record], Path], None],
    tell: Told,
) -> tuple[Search, SearchResult, list[Record], int]:
    """Goes through the generations that an earlier search did not finish; returns the journal and the runs made too."""
    generations = sum(study.tune.generations for study in stages)
    known = finished(folder, tell)
    # A generation follows from all before it.
    told = [known[number] for number in takewhile(known.__contains__, range(1, generations + 1))]
    origin = Candidate(stages[0].gains, ())
    candidate, journal, made, number = origin, list[Record](), 0, 0
    with progress(generations, len(told)) as advance:
        while True:
            study = study_from(scenario, number, candidate) if number else stages[0]
            rest = told[len(journal) :]
            mine = next((rest[:n] for n in range(len(rest)) if ended(rest[:n], study.tune)), rest)
            with workers(study, jobs) as evaluate:
                search = Search(study, evaluate, mine, len(journal), continues=number > 0)
                while not ended(search.journal, study.tune):
                    folder.note(search.generation())
                    after(journal + search.journal, folder.path)
                    advance()
                journal += search.journal
                number = _next(stages, number, search.journal)
                if number == len(stages):
                    found = search.finish(None if study is stages[0] else origin)
                    return search, found, journal, made + search.runs
                candidate = search.space.candidate(search.best()[0])
                made += search.runs


def _next(stages: Sequence[Study], number: int, journal: Sequence[Record]) -> int:
    """The stage that follows on one with this journal; a stage that asks for nothing more is passed over."""
    after = number + 1
    while after < len(stages) and _alike(stages[number], stages[after]) and good_enough(journal, stages[after].tune):
        after += 1
    return after


def _alike(one: Study, other: Study) -> bool:
    """Whether two stages put gaits to the same tests."""
    asked = ("conditions", "checks", "duration", "limits", "floors")
    return one.base == other.base and all(getattr(one.tune, name) == getattr(other.tune, name) for name in asked)
