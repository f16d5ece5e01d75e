"""What `biped tune` does, without argv."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

from biped.base.files import label
from biped.base.json import dumps
from biped.ensemble.folder import Folder
from biped.ensemble.plan import Plan
from biped.scenario.reading import read_scenario
from biped.studies.run import RUNS, title_of
from biped.studies.tune.evaluate import Study, workers
from biped.studies.tune.report import gait_text
from biped.studies.tune.search import Found, Search, strategy
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
    scenario = read_scenario(name, changes)
    study = Study(scenario)
    title = title_of(name)
    strategy(Space(scenario, study.gains), study.tune, scenario.seed)  # complaints come before anything is written
    folder = Folder.new(RUNS, title, Plan(scenario)) if out is None else Folder(out, Plan(scenario))
    began = time.perf_counter()
    try:
        search, found = _search(folder, title, study, jobs)
    except BaseException:
        folder.discard()  # but not what it noted
        raise
    seconds = time.perf_counter() - began
    path = folder.path / "gait.toml"
    folder.save_text(path.name, gait_text(title, search, found))
    result = {
        "scenario": title,
        "folder": label(folder.path),
        "gait": label(path),
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
    folder.save_text("result.json", dumps(result, indent=1))
    folder.close()
    return result


def _search(folder: Folder, title: str, study: Study, jobs: int) -> tuple[Search, Found]:
    """Goes through the generations that an earlier search did not finish."""
    from biped.show.figures.convergence import plot_search
    from biped.show.terminal import progress

    generations = study.tune.generations
    known = {record["index"]: record for record in folder.finished()}
    for words in folder.notes:
        print(f"biped: {words}", file=sys.stderr)
    # A generation follows from all before it.
    told = [known[number] for number in takewhile(known.__contains__, range(1, generations + 1))]
    with workers(study, jobs) as evaluate:
        search = Search(study, evaluate, told)
        with progress(title, generations, len(search.journal)) as advance:
            while len(search.journal) < generations:
                folder.note(search.generation())
                plot_search(search.journal, folder.path / "convergence.png")
                advance()
        return search, search.finish()
