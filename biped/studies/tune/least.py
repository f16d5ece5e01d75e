"""How few of a found gait's gains it takes: gains are put back one by one, each time the one that is missed least."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import label, locate
from biped.base.writing import dumps
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.folder import Folder
from biped.ensemble.guard import OF_RUNS
from biped.ensemble.plan import Plan
from biped.scenario.gains import LACKED, OUT_OF_PLANE, Gains, number, single, with_numbers
from biped.scenario.gait import read_gains
from biped.scenario.reading import read
from biped.studies.folders import finished, folder_for
from biped.studies.run import title_of
from biped.studies.tune import nothing_after
from biped.studies.tune.evaluate import GainOutcome, Study, Task, by_condition, workers
from biped.studies.tune.search_space import Candidate, names_of

Record = dict[str, Any]


class Least(NamedTuple):
    """The result of putting back gains one by one.

    Attributes:
        scenario: Name of the tuning scenario, whose gait is the one that is gone back to.
        gait: Name of the found gait.
        folder: Where the results are.
        steps: By number of gains that were put back: `restored`, the last of them, `before` and `after`, its values,
            `changed`, how many still differ, and `tallies`, per condition runs that did what they should, and runs.
    """

    scenario: str
    gait: str
    folder: Path
    steps: list[Record]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {"scenario": self.scenario, "gait": self.gait, "folder": label(self.folder), "steps": self.steps}


def least(
    name: str,
    gait: str,
    changes: Sequence[str],
    jobs: Jobs,
    out: Path | None,
    progress: Progress = silent,
    after: Callable[[list[Record], Path], None] = nothing_after,
    tell: Told = unheard,
) -> Least:
    """Goes back from a found gait to a scenario's own; an interrupted way back in `out` is continued.

    Which gain is put back next is decided on seeds that all choices of a step share; tallies are of fresh ones.

    Args:
        name: Name or path of the tuning scenario.
        gait: Name or path of the gait that was found.
        changes: `--set` changes.
        jobs: Number of processes, or a cluster.
        out: Results folder; default: a new one below runs/.
        progress: Told of every step.
        after: Called after every step with all steps so far and the folder.
        tell: Told what of an interrupted way could not be used.

    Raises:
        InputError: There is nothing to put back, or the folder holds something else.
    """
    scenario, whence = read(name, changes)
    with whence.naming("tune"):
        study = Study(scenario)
    origin, found = study.gains, read_gains(locate("controllers", gait, "--least"), Gains())
    names = different(origin, found)
    if not names:
        raise InputError(f"--least {gait}: expected another gait than the scenario's own, '{scenario.controller}'")
    title = title_of(name) + "-least"
    with folder_for(out, title, Plan(scenario), foreign=OF_RUNS) as folder:
        steps = _known(folder, gait, len(names), tell)
        with workers(study, jobs) as evaluate, progress(title, len(names) + 1, len(steps)) as advance:
            while len(steps) <= len(names):
                steps.append(folder.note(_step(study, evaluate, gait, origin, found, names, steps)))
                after(steps, folder.path)
                advance()
        done = Least(title_of(name), gait, folder.path, steps)
        folder.save_text("result.json", dumps(done.as_dict(), indent=1))
    return done


def different(origin: Gains, found: Gains) -> list[str]:
    """Names of the single numbers in which two complete gaits differ, out of the plane too where they have such.

    Raises:
        InputError: Only one of them has.
    """
    names = names_of(origin)
    for table in (*LACKED, *OUT_OF_PLANE):
        if (table in names) != (getattr(found, table) is not None):
            which = ("found", "scenario's own") if table in names else ("scenario's own", "found")
            raise InputError(f"gains.{table}: the {which[0]} gait has none and the {which[1]} one has; expected both "
                             "or neither to have it", f"gains.{table}")  # fmt: skip
    return [name for name in single(names) if number(origin, name) != number(found, name)]


def mixed(found: Gains, origin: Gains, back: Sequence[str]) -> Gains:
    """A found gait with some of its numbers put back to those of another."""
    return with_numbers(found, {name: number(origin, name) for name in back})


def _known(folder: Folder, gait: str, count: int, tell: Told) -> list[Record]:
    """Steps that an earlier command finished."""
    known = finished(folder, tell)
    if any(record.get("gait") != gait for record in known.values()):
        raise InputError(
            f"--out {folder.path}: holds another search; expected a new folder, or a way back from '{gait}'"
        )
    steps = []
    while len(steps) <= count and len(steps) in known:
        steps.append(known[len(steps)])
    return steps


def _step(
    study: Study,
    evaluate: Callable[[Sequence[Task]], list[GainOutcome]],
    gait: str,
    origin: Gains,
    found: Gains,
    names: Sequence[str],
    steps: Sequence[Record],
) -> Record:
    """Puts one more gain back, or, as step 0, none."""
    step = len(steps)
    back = [before["restored"] for before in steps if before["restored"]]
    record: Record = {"index": step, "gait": gait, "restored": "", "changed": len(names) - step}
    if step:
        left = [name for name in names if name not in back]
        seed = study.seed("least", step)
        runs = {name: range(condition.runs) for name, condition in study.tune.conditions.items()}
        tasks = [study.tasks(Candidate(mixed(found, origin, [*back, name]), ()), seed, False, runs) for name in left]
        outcomes = iter(evaluate([task for group in tasks for task in group]))
        costs = [study.cost(by_condition(group, [next(outcomes) for _ in group]), 0.0) for group in tasks]
        chosen = left[min(range(len(left)), key=costs.__getitem__)]
        back.append(chosen)
        record |= {"restored": chosen, "before": number(found, chosen), "after": number(origin, chosen)}
    checks = {name: range(study.tune.checks) for name in study.tune.conditions}
    fresh = study.tasks(Candidate(mixed(found, origin, back), ()), study.seed("least.check", step), True, checks)
    outcomes = by_condition(fresh, evaluate(fresh))
    return record | {"tallies": {name: [sum(o.walked for o in made), len(made)] for name, made in outcomes.items()}}
