"""Model files side by side: which are recognised as robots, and whether those stand in the physics they ask for."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from biped.base.errors import InputError
from biped.base.json import dumps
from biped.engines.mujoco import simulate
from biped.ensemble.plan import Plan
from biped.robot.report import ModelReport, look
from biped.scenario.reading import from_text

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
