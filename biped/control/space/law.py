"""The thesis's law for a biped with a free base, as a law of a robot of any kind: `law = "thesis"`."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from biped.base.jit import bound
from biped.control.blending import blend, changes_in, step_type
from biped.control.law import Setup
from biped.control.observation import Observation
from biped.control.space.mistaken import is_mistaken, mistaken_own, mistaken_tick
from biped.control.space.own import Own, Pinocchio, check_kernels, compute, own_of
from biped.control.space.places import Mechanics
from biped.control.space.record import GAIT
from biped.control.space.setup import controller_record, mechanics_of, order_of, set_gains, si_gains, unit_of
from biped.control.space.tick import spatial_tick
from biped.robot.anatomy import anatomy_of
from biped.robot.build import Command
from biped.robot.tree import beyond_tree
from biped.scenario.keys import COMPILED, ENGINE, PINOCCHIO, Scenario

SIGNALS = ("right_state", "left_state", "right_placed", "left_placed", "at_limit", "given_up")
"""Signals of the law: leg states 1 … 4, [rad] by which placement abducts a leg, whether a torque is at its limit, and
whether a problem of the tick was given up: its forces are those of the last set that was tried."""

_ticks: dict[tuple[np.dtype, bool], Callable[..., None]] = {}
"""The compiled tick by the record's type, and whether the law is mistaken."""


def _source(setup: Setup) -> str:
    """Who computes the mechanics: who is asked to, or else the kernels, or MuJoCo where only it can."""
    asked = setup.scenario.control.mechanics
    return asked if asked is not None else ENGINE if beyond_tree(setup.model) else COMPILED


class Spatial:
    """See the module.

    Args:
        setup: The run's.

    Attributes:
        record: (1,) of `biped.control.space.record.control_type`.
        changes: Of it, `biped.control.blending.Changes`.
        by_force: Whether it commands generalized forces, or a share of them.
        source: Who computes the mechanics: `compiled`, `pinocchio` or `engine`.
        mistaken: Whether its torques follow from other masses or lengths than the file's.
        driven: (n,) which of the record's torques actuators have.
        drives: (n,) the actuators that have them.
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
        c = self.record[0]
        mode = setup.scenario.actuation.mode
        self._assist = 1.0 if mode == "generalized" else setup.scenario.actuation.assist
        self._setup, self.source = setup, _source(setup)
        self.mistaken = is_mistaken(setup.scenario)
        self._mechanics: Mechanics | None = None
        self._tick_once: Callable[..., None] = spatial_tick
        self._given: tuple[Any, ...] = ()
        order = order_of(setup.model, setup.robot, anatomy)
        self._moved, self.driven = np.flatnonzero(order.column >= 0), np.flatnonzero(order.drive >= 0)
        self._columns, self.drives = order.column[self._moved], order.drive[self.driven]
        self._of_drive = np.array([drive.column for drive in setup.robot.drives], int)[self.drives]
        tick = c["tick"]
        self._phase, self._placed, self._limited = c["memory"]["phase"], tick["placed"], self.record["tick"]["limited"]
        self._given_up = self.record["tick"]["given_up"]
        self._Q_d, self._passive, self._u = tick["Q_d"], tick["passive"], tick["u"]
        self.by_force = self._assist > 0.0
        self._size = setup.model.nv if self.by_force else len(setup.robot.drives)

    def own(self, q: np.ndarray, v: np.ndarray) -> Own | None:
        """Mechanics that compiled code brings to coordinates and velocities (live); None where they are the engine's.

        Raises:
            InputError: The model has parts that only MuJoCo computes with.
        """
        if self.source != COMPILED:
            return None
        own = own_of(self.record[0], self._setup.model, q, v)
        check_kernels(self.record[0], self._setup.model, own.tree)
        return own

    def owns(self, q: np.ndarray, v: np.ndarray) -> tuple[Own, ...]:
        """Mechanics of `own`, and after it those of a law that is mistaken; () where there are none of the law's own.

        Raises:
            InputError: As of `own`.
        """
        if (own := self.own(q, v)) is None:
            return ()
        wrong = mistaken_own(self.record[0], self._setup, q, v)
        return (own,) if wrong is None else (own, wrong)

    def _mechanics_at(self, sensed: Observation) -> tuple[Mechanics, Callable[[], Any]]:
        """The mechanics of what is sensed, and what brings them up to date."""
        data = sensed._data
        if (own := self.own(data.qpos, data.qvel)) is not None:
            return own.mechanics, partial(bound(compute, *own), *own)
        if self.source == PINOCCHIO:
            theirs = Pinocchio(self.record[0], self._setup.model, data.qpos, data.qvel)
            return theirs.mechanics, theirs.renew
        return mechanics_of(self.record[0], sensed._model, data), lambda: sensed._data

    @staticmethod
    def command(scenario: Scenario) -> Command:
        """Returns the kind of command that `torques` returns."""
        actuation = scenario.actuation
        return "generalized" if actuation.mode == "generalized" or actuation.assist else "torque"

    def torques(self, sensed: Observation) -> np.ndarray:
        """(nu,) joint torques [N m]; or (nv,) Q_d, or a share of it, with what makes up for the joints' own damping."""
        first = sensed.time == 0.0
        if self._mechanics is None:
            self._mechanics, self._renew = self._mechanics_at(sensed)
            wrong = mistaken_own(self.record[0], self._setup, sensed._data.qpos, sensed._data.qvel)
            self._given = self.record, self._mechanics, *(wrong or ())
            kind = self.record.dtype, self.mistaken
            if kind not in _ticks:  # looking it up takes as long as a hundred ticks
                _ticks[kind] = bound(mistaken_tick if self.mistaken else spatial_tick, *self._given, first)
            self._tick_once = _ticks[kind]
        if len(self.changes.steps):
            blend(self.changes, round(sensed.time / self._tick))
        self._renew()
        self._tick_once(*self._given, first)
        right, left = self._phase.tolist()
        self.signals = dict(zip(SIGNALS, (right + 1.0, left + 1.0, *self._placed.tolist(), float(self._limited[0]),
                                          float(self._given_up[0] > 0)), strict=True))  # fmt: skip
        out, share = np.zeros(self._size), self._assist
        if share:
            out[self._columns] = share * (self._Q_d + self._passive)[self._moved]
            if share < 1.0:
                out[self._of_drive] += (1.0 - share) * self._u[self.driven]
        else:
            out[self.drives] = self._u[self.driven]
        return out
