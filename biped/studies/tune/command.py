"""What `biped tune` does, without argv."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from biped.ensemble.plan import Plan
from biped.ensemble.results import Folder, new_folder
from biped.scenario.reading import read_scenario
from biped.studies.run import RUNS, title_of
from biped.studies.tune.evaluate import Study, workers
from biped.studies.tune.report import gait_text
from biped.studies.tune.search import Search, strategy
from biped.studies.tune.space import Space


def tune(name: str, changes: Sequence[str], jobs: int, out: Path | None) -> dict[str, Any]:
    """Searches for the gait that a tuning scenario asks for; goes on where an interrupted search in `out` stopped.

    Args:
        name: Name or path of the scenario.
        changes: `--set` changes.
        jobs: Number of processes.
        out: Results folder; default: a new one below runs/.

    Returns:
        `scenario`, `folder`, `gait` (its file), `objective` and `before`, `conditions` (on unseen seeds, by name),
        `keys`, `runs` and `runs_per_second`.
    """
    from biped.show.figures.convergence import plot_search
    from biped.show.terminal import progress

    scenario = read_scenario(name, changes)
    study = Study(scenario)
    title = title_of(name)
    strategy(Space(scenario, study.gains), study.tune, scenario.seed)  # complaints come before anything is written
    folder = Folder(out if out is not None else new_folder(RUNS, title.replace("/", "-")), Plan(scenario))
    generations = study.tune.generations
    began = time.perf_counter()
    with workers(study, jobs) as evaluate:
        search = Search(study, evaluate, folder.finished()[:generations])
        with progress(title, generations, len(search.journal)) as advance:
            while len(search.journal) < generations:
                folder.note(search.generation())
                plot_search(search.journal, folder.path / "convergence.png")
                advance()
        found = search.finish()
    seconds = time.perf_counter() - began
    path = folder.path / "gait.toml"
    path.write_text(gait_text(title, search, found), encoding="utf-8")
    result = {
        "scenario": title,
        "folder": str(folder.path),
        "gait": str(path),
        "objective": found.cost,
        "before": found.start_cost,
        "conditions": {
            name: tally._asdict() | {"before": found.start_tallies[name]._asdict()}
            for name, tally in found.tallies.items()
        },
        "keys": dict(search.space.candidate(found.x).keys),
        "runs": search.runs,
        "runs_per_second": search.runs / seconds,
    }
    folder.write_result(result)
    return result
