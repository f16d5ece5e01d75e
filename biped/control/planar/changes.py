"""Changes during a run in the plane: gains, and settings of the actuation, of a scenario's [[change]] tables."""

from __future__ import annotations

import math

import numpy as np

from biped.base.jit import kernel
from biped.control.blending import Changes, blend, changes_in, step_type
from biped.control.planar.record import GAIT
from biped.control.planar.setup import set_gains
from biped.robot.run import Run

CHANGE = step_type(GAIT, ("release", "i8"), ("release_force", "f8"))
"""One change; its settings are -1 and nan where they are not changed."""


def changes_of(run: Run, record: np.ndarray) -> Changes:
    """A run's changes of its controller's record (1,)."""
    out = changes_in(record, CHANGE, run.scenario, run.gains, set_gains)
    for c, change in zip(out.steps, run.scenario.change, strict=True):
        contacts, force = change.actuation.contacts, change.actuation.release_force
        c["release"] = -1 if contacts is None else contacts == "released"
        c["release_force"] = math.nan if force is None else force
    return out


@kernel
def bring_up_to_date(record, changes, k):
    """Brings the controller's record (1,) to tick k of its `Changes`; k goes through every tick."""
    blend(changes, k)
    actuation, steps = record[0]["actuation"], changes.steps
    for i in range(steps.size):
        step = steps[i]
        if step["first"] != k:
            continue
        if step["release"] >= 0:
            actuation["release"] = step["release"]
        if not math.isnan(step["release_force"]):
            actuation["release_force"] = step["release_force"]
