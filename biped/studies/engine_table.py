"""How many of so many runs of each scenario walk or stand in each engine: the table of docs/engines.md."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import names
from biped.base.paired import means
from biped.ensemble.backend import Jobs, Progress, silent
from biped.studies.run import plan_of, run, title_of

RUNS = 20
"""Of each scenario in each engine, at least."""
SCENARIOS = (
    "upright/level", "upright/push", "upright/slope", "upright/model_error", "upright/control_rate",
    "robot/level", "spatial/level", "any/walk", "any/h1_walk", "any/h1", "any/humanoid", "any/human", "any/robot",
    "any/walker2d",
)  # fmt: skip
"""Scenarios of the table, besides those of public policies, which are nobody's to ship."""


class Cell(NamedTuple):
    """A scenario in an engine.

    Attributes:
        reached: Runs that walked; where the scenario asks for standing, that stood.
        runs: All runs.
        speed: [m/s] mean of those that walked, and half of its 95 % interval; nan where there is none.
        failures: What became of the others: point or seed, end and cause.
    """

    reached: int
    runs: int
    speed: tuple[float, float]
    failures: list[str]


class ScenarioCells(NamedTuple):
    """A row of the table.

    Attributes:
        scenario: Its name; of one that is not shipped, its description.
        goal: `walked` or `stood`.
        cells: By engine; in words where one cannot simulate it, None where it was not run.
    """

    scenario: str
    goal: str
    cells: dict[str, Cell | str | None]


def cells_of(
    name: str,
    engines: Sequence[str],
    jobs: Jobs,
    folder: Path,
    runs: int = RUNS,
    progress: Progress = silent,
    finished: bool = False,
) -> ScenarioCells:
    """Runs a scenario in engines; what an earlier call finished in the folder is not repeated.

    Args:
        name: Name or path of the scenario; of a sweep each point has a share of the runs.
        engines: Names of engines.
        jobs: Number of processes.
        folder: Where results folders go, one for each cell.
        runs: At least so many of each cell.
        progress: Told of every finished run.
        finished: Whether to make no runs: cells are those that earlier calls have finished, of however many runs.

    Raises:
        InputError: The scenario cannot be used in any engine.
    """
    plain, title = plan_of(name, ()), title_of(name)
    points = len(plain) // plain.scenario.randomise.runs
    goal = "stood" if "stood" in plain.scenario.expect and "walked" not in plain.scenario.expect else "walked"
    cells: dict[str, Cell | str | None] = {}
    for engine in engines:
        changes = [f"engine={engine}", f"randomise.runs={math.ceil(runs / points)}"]
        try:
            plan_of(name, changes)
        except InputError as error:
            cells[engine] = str(error)
            continue
        where = folder / title.replace("/", "-") / engine
        if finished:
            result = where / "result.json"
            rows = json.loads(result.read_text(encoding="utf-8"))["runs"] if result.is_file() else None
        else:
            rows = run(name, changes, jobs, where, progress=progress).result["runs"]
        cells[engine] = None if rows is None else _cell(rows, goal)
    shipped = title in names("scenarios")
    return ScenarioCells(f"`{title}`" if shipped else plain.scenario.description or title, goal, cells)


def _cell(rows: Sequence[dict[str, Any]], goal: str) -> Cell:
    reached = [row for row in rows if row[goal]]
    speed = means([row["speed"] for row in reached if row["speed"] is not None and math.isfinite(row["speed"])])
    failures = [
        f"{row['values'] or row['seed']}: {row['end']} {row['cause'] or row.get('doubt', '')}"
        for row in rows if not row[goal]
    ]  # fmt: skip
    return Cell(len(reached), len(rows), (speed.change, speed.high - speed.change),
                failures)  # fmt: skip
