"""What changes during a run: the gains and settings of a scenario's [[change]] tables, in the controller's record."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from biped.control.law import Tick
from biped.control.record import GAIT
from biped.control.setup import set_gains
from biped.robot.run import Run
from biped.scenario.gains import Gains
from biped.scenario.keys import ActuationChange


class _Step(NamedTuple):
    """One change in ticks.

    Attributes:
        first: The tick it begins with.
        count: Ticks until its gains hold.
        before: The gait that it begins at.
        after: The gait that it ends at.
        actuation: Settings that change with the first tick.
    """

    first: int
    count: int
    before: np.void
    after: np.void
    actuation: ActuationChange


def changing(run: Run, c: np.void, tick: Tick) -> Tick:
    """A tick that first brings the controller's record up to date.

    Args:
        run: Its scenario's changes; gains that they do not name stay as they are.
        c: The record that `tick` reads.
        tick: The tick itself.
    """
    pending = deque(_steps(run))

    def changed(k: int, time: float) -> int:
        while pending and k >= pending[0].first and _applied(c, pending[0], k):
            pending.popleft()
        return tick(k, time)

    return changed


def _steps(run: Run) -> list[_Step]:
    steps, gains, rate = [], run.gains, run.scenario.simulation.control_rate
    for change in run.scenario.change:
        before, gains = gains, gains.replaced(change.gains)
        count = max(1, round(change.over * rate))
        steps.append(_Step(round(change.at * rate), count, _as_record(before), _as_record(gains), change.actuation))
    return steps


def _as_record(gains: Gains) -> np.void:
    gait = np.zeros(1, GAIT)[0]
    set_gains(gait, gains)
    return gait


def _applied(c: np.void, step: _Step, k: int) -> bool:
    """Brings the record to tick k of a change; returns whether the change is complete."""
    share = min(1.0, (k - step.first + 1) / step.count)
    for name in GAIT.fields or ():
        c["gait"][name] = (1.0 - share) * step.before[name] + share * step.after[name]
    if step.actuation.contacts is not None:
        c["actuation"]["release"] = step.actuation.contacts == "released"
    if step.actuation.release_force is not None:
        c["actuation"]["release_force"] = step.actuation.release_force
    return share == 1.0
