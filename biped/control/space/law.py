"""The thesis's law for a biped with a free base, as a law of a robot of any kind: `law = "spatial"`."""

from __future__ import annotations

import numpy as np

from biped.control.blending import blend, changes_in, step_type
from biped.control.law import Setup
from biped.control.observation import Observation
from biped.control.space.places import Mechanics
from biped.control.space.record import GAIT
from biped.control.space.setup import controller_record, mechanics_of, set_gains
from biped.control.space.tick import spatial_tick
from biped.robot.build import Command
from biped.scenario.keys import Scenario

SIGNALS = ("right_state", "left_state", "right_placed", "left_placed", "at_limit")
"""Signals of the law: leg states 1 … 4, [rad] by which placement abducts a leg, whether a torque is at its limit."""


class Spatial:
    """See the module.

    Args:
        setup: The run's.

    Attributes:
        record: (1,) `biped.control.space.record.CONTROL`.
        changes: Of it, `biped.control.blending.Changes`.
        signals: As of the latest tick.
    """

    def __init__(self, setup: Setup):
        self.record = controller_record(setup)
        self.changes = changes_in(self.record, step_type(GAIT), setup.scenario, setup.gains, set_gains)
        self._tick = setup.tick
        self.signals = dict.fromkeys(SIGNALS, 0.0)
        self._generalized = bool(self.record["actuation"]["generalized"][0])
        self._mechanics: Mechanics | None = None

    @staticmethod
    def command(scenario: Scenario) -> Command:
        """The result of `torques`."""
        return "generalized" if scenario.actuation.mode == "generalized" else "torque"

    def torques(self, sensed: Observation) -> np.ndarray:
        """(12,) joint torques [N m]; or (18,) Q_d."""
        if self._mechanics is None:
            self._mechanics = mechanics_of(sensed.robot, sensed._data)
        if len(self.changes.steps):
            blend(self.changes, round(sensed.time / self._tick))
        spatial_tick(self.record, self._mechanics, sensed.time == 0.0)
        c = self.record[0]
        values = (*(c["memory"]["phase"] + 1), *c["tick"]["placed"], c["tick"]["limited"])
        self.signals = dict(zip(SIGNALS, (float(value) for value in values), strict=True))
        return (c["tick"]["Q_d"] if self._generalized else c["tick"]["u"]).copy()
