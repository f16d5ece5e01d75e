"""The thesis's law for a biped with a free base, as a law of a robot of any kind: `law = "spatial"`."""

from __future__ import annotations

import numpy as np

from biped.control.blending import blend, changes_in, step_type
from biped.control.law import Setup
from biped.control.observation import Observation
from biped.control.space.places import Mechanics
from biped.control.space.record import GAIT
from biped.control.space.setup import controller_record, mechanics_of, order_of, set_gains
from biped.control.space.tick import spatial_tick
from biped.control.space.units import si_gains, unit_of
from biped.robot.anatomy import anatomy_of
from biped.robot.build import Command
from biped.scenario.keys import Scenario

SIGNALS = ("right_state", "left_state", "right_placed", "left_placed", "at_limit")
"""Signals of the law: leg states 1 … 4, [rad] by which placement abducts a leg, whether a torque is at its limit."""


class Spatial:
    """See the module.

    Args:
        setup: The run's.

    Attributes:
        record: (1,) of `biped.control.space.record.control_type`.
        changes: Of it, `biped.control.blending.Changes`.
        signals: As of the latest tick.
    """

    def __init__(self, setup: Setup):
        self.record = controller_record(setup)
        anatomy = anatomy_of(setup.model, setup.robot)
        unit = unit_of(setup.robot, anatomy)
        self.changes = changes_in(
            self.record, step_type(GAIT), setup.scenario, setup.gains,
            lambda gait, gains: set_gains(gait, si_gains(gains, unit)),
        )  # fmt: skip
        self._tick = setup.tick
        self.signals = dict.fromkeys(SIGNALS, 0.0)
        self._generalized = bool(self.record["actuation"]["generalized"][0])
        self._mechanics: Mechanics | None = None
        order = order_of(setup.model, setup.robot, anatomy)
        self._where = order.column if self._generalized else order.drive
        self._there = self._where >= 0
        self._out = np.zeros(setup.model.nv if self._generalized else len(setup.robot.drives))

    @staticmethod
    def command(scenario: Scenario) -> Command:
        """Returns the kind of command that `torques` returns."""
        return "generalized" if scenario.actuation.mode == "generalized" else "torque"

    def torques(self, sensed: Observation) -> np.ndarray:
        """(nu,) joint torques [N m]; or (nv,) Q_d, with what makes up for the joints' own damping."""
        if self._mechanics is None:
            self._mechanics = mechanics_of(self.record[0], sensed._model, sensed._data)
        if len(self.changes.steps):
            blend(self.changes, round(sensed.time / self._tick))
        spatial_tick(self.record, self._mechanics, sensed.time == 0.0)
        c = self.record[0]
        tick = c["tick"]
        values = (*(c["memory"]["phase"] + 1), *tick["placed"], tick["limited"])
        self.signals = dict(zip(SIGNALS, (float(value) for value in values), strict=True))
        out, where = self._out, self._where
        out[where[self._there]] = (tick["Q_d"] + tick["passive"] if self._generalized else tick["u"])[self._there]
        return out.copy()
