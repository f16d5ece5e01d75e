"""`biped tune`: the gait that a scenario's search finds, what it scores, and a gait file that says how it was found.

A search may have stages: easy conditions first, or a gain led step by step to where a search would not go by itself.
"""

import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from msgspec import to_builtins

from biped.base.errors import InputError
from biped.base.files import label
from biped.base.statistics import wilson
from biped.base.writing import dumps
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.guard import OF_RUNS
from biped.ensemble.plan import Plan
from biped.scenario.gains import GAINS, NOT_NEEDED, OUT_OF_PLANE
from biped.scenario.gait import gait_settings, is_setting
from biped.scenario.reading import read
from biped.scenario.transitions import Transitions, transitions_of
from biped.scenario.vary import ChangeOrigin, with_values
from biped.studies.folders import folder_for
from biped.studies.run import title_of
from biped.studies.tune.search import Record, Search, SearchResult, Tally, strategy
from biped.studies.tune.search_space import SearchSpace
from biped.studies.tune.stages import Begun, beginnings, postured, search_through, studies


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
        f"from the gait '{start}', {len(journal)} generations of {tune.population} ({runs} runs); "
        + (f"this is the mean of generation {found.generation}." if found.generation else "none was better than it."),
        f"On {tune.unseen} runs per condition with seeds never used before (walked, 95 % interval; before: {start}):",
        *(_line(name, tally, found.start_tallies[name]) for name, tally in found.tallies.items()),
        f"objective {found.cost:.4f}, before {found.start_cost:.4f}",
    ]
    keys: dict[str, float | str] = dict(candidate.keys)
    if found.posture:
        keys["start.posture"] = found.posture
        lines.append(f"Its walk begins in '{found.posture}', the best for it of {', '.join(tune.postures)}.")
    settings = gait_settings(with_values(study.scenario, keys, ChangeOrigin("tune.keys")))
    others = [(key, value) for key, value in candidate.keys if not is_setting(key)]
    if others:
        lines += ["It was found together with these settings, which a scenario must have:"]
        lines += [f"  {key} = {value:g}" for key, value in others]
    head = "".join(f"# {line}\n" for line in lines)
    if tune.change is not None:
        settings.pop("start", None)  # it is where the run begins, not the change
    elif start:
        usual = to_builtins(Transitions())
        named = {key: value for key, value in to_builtins(transitions_of(start)).items() if value != usual[key]}
        settings |= {"transitions": named} if named else {}
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
    most: int | None = None,
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
        most: Generations after which it ends, such as those of an interrupted search; default: the scenario's.

    Raises:
        InputError: Something the user wrote cannot be used, or the folder's gait is not what the search found.
    """
    scenario, origin = read(name, changes)
    with origin.naming("tune"):  # complaints come before anything is written
        stages = studies(scenario)
        places = beginnings(scenario, name, changes)
        list(postured(stages[0]))
        strategy(SearchSpace(stages[0].scenario, stages[0].gains), stages[0].tune, scenario.seed)
    title = title_of(name)
    began, cpu = time.perf_counter(), _cpu()
    with folder_for(out, title, Plan(scenario), foreign=OF_RUNS) as folder:
        search, found, journal, made = search_through(
            folder, Begun(scenario, stages), places, jobs, partial(progress, title), after, tell, most
        )
        seconds = time.perf_counter() - began
        path = folder.path / "gait.toml"
        text = gait_text(title, search, found, journal)
        if path.is_file() and path.read_text(encoding="utf-8") != text:
            raise InputError(
                f"{label(path)}: is not what this search found; move it away, so that it is not written over"
            )
        folder.save_text(path.name, text)
        tuned = Tuned(title, folder.path, path, found, dict(found.candidate.keys), made, seconds, _cpu() - cpu)
        folder.save_text("result.json", dumps(tuned.as_dict(), indent=1))
    return tuned


def _cpu() -> float:
    """[s] of this process and of its children that have ended."""
    return sum(os.times()[:4])
