"""The model that a run is drawn with."""

from __future__ import annotations

from pathlib import Path

import mujoco
from msgspec import structs

from biped.robot.ground import levelled
from biped.scenario.keys import Scenario


def visual_model(path: Path, scenario: Scenario) -> mujoco.MjModel:
    """A scenario's model with all that is only looked at; not to be written to."""
    if scenario.robot is not None:
        from biped.robot.build import compiled

        # Heights along the way are drawn by themselves.
        return compiled(path, structs.replace(scenario, ground=levelled(scenario.ground)), "torque")
    from biped.robot.planar.build import compile_foreign

    return compile_foreign(path, scenario, visuals=True).model
