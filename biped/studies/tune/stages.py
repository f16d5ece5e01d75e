"""A search in stages: easy conditions first, or a gain led step by step to where a search would not go by itself."""

from pathlib import Path

from msgspec.structs import replace

from biped.base.errors import InputError
from biped.base.files import nearest
from biped.ensemble.plan import Plan
from biped.scenario.gains import Gains, single, with_numbers
from biped.scenario.keys import Scenario
from biped.scenario.reading import changed
from biped.scenario.tune import Stage
from biped.scenario.vary import ChangeOrigin, with_values
from biped.studies.tune.evaluate import Study
from biped.studies.tune.space import Candidate, SearchSpace, names_of


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
    found = with_values(replace(scenario, gains=candidate.gains), dict(candidate.keys), ChangeOrigin("tune.keys"))
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
        enough=stage.enough or tune.enough,
    )
    whole = replace(scenario, tune=part)
    if stage.set:
        whole = changed(whole, stage.set, Path(f"{key}.set"))
    return replace(whole, gains=_held(Study(whole).gains, stage, key)) if stage.hold else whole


def _begun(scenario: Scenario) -> Gains:
    """The complete gait that a tuning scenario begins with."""
    return Plan(replace(scenario, tune=None, sweep={}, expect={}, thesis={})).run(0).gains


def _held(gains: Gains, stage: Stage, key: str) -> Gains:
    """A complete gait with the values that a stage holds."""
    known = single(names_of(gains))
    for name in stage.hold:
        if name not in known:
            raise InputError(f"{key}.hold: no gain '{name}'; {nearest(name, known)}")
    return with_numbers(gains, stage.hold)
