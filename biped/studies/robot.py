"""The robot in a model file, recognised before anything of it is run."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from biped.base.errors import InputError
from biped.base.files import description_of, is_file, label, locate, read_toml
from biped.robot.recognise import looked_at
from biped.robot.robot import Robot
from biped.robot.spec import parsed
from biped.scenario.general import KIND
from biped.scenario.keys import Simulation
from biped.scenario.laws import BUILT_IN, SPATIAL
from biped.scenario.options import differing
from biped.scenario.robot import Described
from biped.scenario.valid import convert, known_keys


class ModelReport(NamedTuple):
    """Everything recognised in a model file.

    Attributes:
        file: It.
        description: The file that describes it; None: everything was recognised.
        robot: What it is; None if it cannot be run.
        faults: All that is wrong, and what to write.
        planar: Why the thesis's law cannot walk it; empty if it can.
        laws: The laws of this package that it runs with, beside a law of one's own.
        notes: What of the file was left out, without harm.
        physics: What the file asks for and a run does otherwise by default; empty where they agree.
    """

    file: Path
    description: Path | None
    robot: Robot | None
    faults: tuple[str, ...]
    planar: str
    laws: tuple[str, ...]
    notes: tuple[str, ...]
    physics: str

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {
            "file": label(self.file), "description": None if self.description is None else label(self.description),
            "faults": list(self.faults), "seven_links": not self.planar, "laws": list(self.laws),
            "notes": list(self.notes), "physics": self.physics,
            "robot": None if self.robot is None else msgspec.to_builtins(self.robot) | {"mass": self.robot.mass},
        }  # fmt: skip


def look(name: str) -> ModelReport:
    """Everything recognised in a model file.

    Args:
        name: Name in models/, or path of an MJCF or URDF file.

    Raises:
        InputError: There is no such file, it is no model at all, or its description says what it cannot.
    """
    path = locate("models", name, "model")
    own = path.with_suffix(".toml")
    data = read_toml(own) if is_file(own) else {}
    general = data.pop("kind", None) == KIND
    data.pop("scenario", None)
    table = Described()
    if general:

        def fail(key: str, what: str) -> InputError:
            return InputError(f"{label(own)}: {key}: {what}")

        known_keys(data, Described, "", fail)
        table = convert(data, Described, fail)
    robot, faults, notes = looked_at(path, table)
    laws = () if robot is None else _laws(path, table, robot)
    physics = "" if robot is None else differing(path, Simulation())
    return ModelReport(path, own if general else None, robot, faults, _planar(path, general), laws, notes, physics)


def _laws(path: Path, table: Described, robot: Robot) -> tuple[str, ...]:
    """Laws of this package that a robot runs with: those for any, and the thesis's in space if it has its joints."""
    from biped.control.space.setup import check_robot

    found = [name for name in BUILT_IN if name != SPATIAL]
    with suppress(InputError):
        check_robot(robot, parsed(path, table)[1], path.stem)
        found.insert(0, SPATIAL)
    return tuple(found)


def _planar(path: Path, general: bool) -> str:
    """Why a model is no planar biped of seven links; empty if it is one."""
    if general or path.suffix != ".xml":
        return "it is described as another"
    from biped.robot.planar.model import tree_at

    try:
        description_of(path)
        tree_at(path)
    except InputError as error:
        return str(error)
    return ""
