"""Tables of many: which model files are robots that stand, and how many runs of each scenario walk in each engine."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.files import names
from biped.base.statistics import means
from biped.base.writing import dumps
from biped.engines.mujoco import simulate
from biped.ensemble.backend import Jobs, Progress, silent
from biped.ensemble.plan import Plan
from biped.robot.report import ModelReport, look
from biped.scenario.reading import from_text
from biped.studies.run import plan_of, run, title_of

SECONDS = 2.0
"""[s] of standing."""


class SurveyedModel(NamedTuple):
    """A model file in one row.

    Attributes:
        file: As named.
        mass: [kg]; None of a file that is refused, as are the next two.
        actuators: How many.
        feet: Contact points of each foot.
        refused: Why it is no robot that runs here; empty if it is one.
        stood: Whether it stood to the end; None: not tried.
        end: How that ended, in words.
    """

    file: str
    mass: float | None = None
    actuators: int | None = None
    feet: tuple[int, ...] = ()
    refused: str = ""
    stood: bool | None = None
    end: str = ""


def survey(names: Sequence[str], stands: bool) -> list[SurveyedModel]:
    """Looks at model files, one after the other.

    Args:
        names: Names in models/, or paths of MJCF or URDF files.
        stands: Whether to have those that are recognised stand.
    """
    out = []
    for name in names:
        try:
            found = look(name)
        except InputError as error:
            out.append(SurveyedModel(name, refused=str(error)))
            continue
        robot = found.robot
        if robot is None:
            out.append(SurveyedModel(name, refused=found.faults[0]))
            continue
        row = SurveyedModel(name, robot.mass, len(robot.drives), tuple(len(foot.points) for foot in robot.feet))
        out.append(_tried(row, found) if stands else row)
    return out


def _tried(row: SurveyedModel, found: ModelReport) -> SurveyedModel:
    """The row, with how the robot stands by the law `stand` in the physics that its file asks for."""
    described = "" if found.description else "robot = {}\n"
    text = (f'model = {dumps(row.file)}\nlaw = "stand"\nduration = {SECONDS}\nsimulation.physics = "file"\n'
            f"window = {{ start = 0.0, end = {SECONDS} }}\n{described}")  # fmt: skip
    try:
        t: Any = simulate(Plan(from_text(text, Path("stand.toml"))).run(0))
    except InputError as error:
        return row._replace(stood=False, end=str(error))
    return row._replace(stood=t.end == "completed", end=t.cause)


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
