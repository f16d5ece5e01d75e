"""Shipped robots with some part changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco

from biped.base.files import locate
from biped.robot.anatomy import anatomy_of
from biped.robot.recognise import robot_of
from biped.scenario.robot import Described

Edit = Callable[[mujoco.MjSpec], object]
SIDES = ("right", "left")


def nothing(spec: mujoco.MjSpec) -> None:
    """Leaves it as it is."""


def built(folder: Path, edit: Edit = nothing, model: str = "h1"):
    """A shipped robot with some part of it changed: its model, what is recognised, its anatomy."""
    spec = mujoco.MjSpec.from_file(str(locate("models", model, "model")))
    edit(spec)
    path = folder / "changed.xml"
    path.write_text(spec.to_xml())
    robot = robot_of(path, Described())
    compiled = mujoco.MjModel.from_xml_path(str(path))
    return compiled, robot, anatomy_of(compiled, robot)
