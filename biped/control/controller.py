"""The law of a run: the thesis's, compiled, or a user's own (`biped.control.user`)."""

from __future__ import annotations

from functools import partial

import numpy as np
import pinocchio

from biped.base.jit import bound
from biped.control.law import WORLD, Law, Tick
from biped.control.setup import controller_record
from biped.control.tick import NOT_FINITE, log_tick, thesis_tick
from biped.robot.model import believed_model
from biped.robot.run import Run
from biped.robot.tree import Tree


class ThesisLaw:
    """Braun & Goldfarb's law: Pinocchio's M and Jacobians, then one compiled tick.

    Args:
        run: Scenario, gains and draws.
        believed: Lengths the controller believes in.
        q: (9,) measured joint coordinates, live.
        v: (9,) measured joint velocities, live.
        log: (n, WIDTH) log that ticks write.

    Attributes:
        u: (6,) joint torques of the latest tick [N m].
        Q_d: (9,) desired generalized forces of the latest tick.
        tick: One control tick (k, time [s]); see `Law`.
    """

    def __init__(self, run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray):
        self.record = controller_record(run, believed)
        self.c = self.record[0]
        self.u, self.Q_d = self.c["tick"]["u"], self.c["tick"]["Q_d"]
        model = believed_model(run.model, run.scenario.ground.slope)
        self.tick = self._bound(model, q, v, log)
        if self.c["actuation"]["bounded"]:
            self.tick = partial(self._bounded_tick, self.tick, q, v, log)
        if run.scenario.change:
            from biped.control.changes import changing

            self.tick = changing(run, self.c, self.tick)

    def _bound(self, model: pinocchio.Model, q: np.ndarray, v: np.ndarray, log: np.ndarray) -> Tick:
        """The tick as a closure over the run's arrays: looking them up would cost as much as the leg states do."""
        data, record, crba = model.createData(), self.record, pinocchio.crba
        M, J = data.M, data.J
        kernel = bound(thesis_tick, record, M, J, q, v, log, 0, 0.0)

        def tick(k: int, time: float) -> int:
            crba(model, data, q, WORLD)  # fills M (upper triangle) and J
            return kernel(record, M, J, q, v, log, k, time)

        return tick

    def _bounded_tick(self, tick: Tick, q: np.ndarray, v: np.ndarray, log: np.ndarray, k: int, time: float) -> int:
        """A tick that solves the bounded problem where a torque limit is exceeded."""
        status = tick(k, time)
        if self.c["tick"]["over"] and status != NOT_FINITE:
            from biped.control.bounded import bounded_torques

            self.u[:] = bounded_torques(self.c)
            log_tick(self.record, q, v, log, k, time)
        return status


def law_of(run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray) -> Law:
    """The control law of a run, bound to its measurements and its log."""
    if run.scenario.law is None and run.law is None:
        return ThesisLaw(run, believed, q, v, log)
    from biped.control.user import UserLaw

    return UserLaw(run, believed, q, v, log)
