"""What changes during a run: the gains and settings of a scenario's [[change]] tables, in the controller's record."""

from __future__ import annotations

import math

import numpy as np

from biped.base.jit import kernel
from biped.control.record import GAIT
from biped.control.setup import set_gains
from biped.robot.leg_states import STATES
from biped.robot.run import Run
from biped.robot.topology import SEGMENTS

CHANGE = np.dtype(
    [
        ("first", "i8"), ("count", "i8"), ("complete", "u1"),  # ticks: its first, and until its gains hold
        ("before", GAIT), ("after", GAIT),
        ("release", "i8"), ("release_force", "f8"),  # -1 and nan: not changed
    ],
    align=True,
)  # fmt: skip
"""One change in ticks: the gaits that it begins and ends at, and settings that change with its first tick."""


def changes_of(run: Run) -> np.ndarray:
    """A run's changes (n,) of `CHANGE`, in time order; gains that a change does not name stay as they are."""
    out = np.zeros(len(run.scenario.change), CHANGE)
    gains, rate = run.gains, run.scenario.simulation.control_rate
    for c, change in zip(out, run.scenario.change, strict=True):
        c["first"], c["count"] = round(change.at * rate), max(1, round(change.over * rate))
        set_gains(c["before"], gains)
        gains = gains.replaced(change.gains)
        set_gains(c["after"], gains)
        contacts, force = change.actuation.contacts, change.actuation.release_force
        c["release"] = -1 if contacts is None else contacts == "released"
        c["release_force"] = math.nan if force is None else force
    return out


@kernel
def bring_up_to_date(record, changes, k):
    """Brings the controller's record (1,) to tick k of its changes (n,)."""
    c = record[0]
    actuation = c["actuation"]
    for i in range(changes.size):
        step = changes[i]
        if step["complete"]:
            continue
        if k < step["first"]:
            return
        _blend(c["gait"], step["before"], step["after"], min(1.0, (k - step["first"] + 1) / step["count"]))
        if step["release"] >= 0:
            actuation["release"] = step["release"]
        if not math.isnan(step["release_force"]):
            actuation["release_force"] = step["release_force"]
        step["complete"] = k - step["first"] + 1 >= step["count"]
        if not step["complete"]:
            return


@kernel
def _blend(gait, before, after, share):
    """Writes the gains this far on the way from `before` to `after`."""
    rest = 1.0 - share
    gait["k_d1"] = rest * before["k_d1"] + share * after["k_d1"]
    gait["b_d1"] = rest * before["b_d1"] + share * after["b_d1"]
    gait["theta_b"] = rest * before["theta_b"] + share * after["theta_b"]
    for s in range(STATES):
        for j in range(SEGMENTS):
            gait["k"][s, j] = rest * before["k"][s, j] + share * after["k"][s, j]
            gait["b"][s, j] = rest * before["b"][s, j] + share * after["b"][s, j]
        gait["theta_l"][s] = rest * before["theta_l"][s] + share * after["theta_l"][s]
        gait["theta_a"][s] = rest * before["theta_a"][s] + share * after["theta_a"][s]
