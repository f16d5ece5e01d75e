"""The thesis's control law, compiled, and what an engine needs of any law (a user's own: `biped.control.user`).

A law is bound to the measured coordinates of one run and ticks through it; what it wants is left in `u` and `Q_d`.
"""

from __future__ import annotations

from functools import partial
from typing import Protocol

import numpy as np
import pinocchio

from biped.base.jit import bound
from biped.control import record
from biped.control.tick import NOT_FINITE, Tick, log_tick, thesis_tick
from biped.robot.model import believed_model, gravity, torque_limits
from biped.robot.run import Run
from biped.robot.tree import Tree
from biped.scenario.keys import Scenario

WORLD = pinocchio.Convention.WORLD


def controller_record(run: Run, believed: Tree) -> np.ndarray:
    """The compiled tick's record for a run.

    Args:
        run: Scenario, gains and draws.
        believed: Lengths the controller believes in.

    Returns:
        Array (1,) of `biped.control.record.CONTROL`.
    """
    s = run.scenario
    out = record.new()
    c = out[0]
    record.set_gains(c, run.gains)
    c["point"], c["centre"], c["mass"] = believed.point, believed.com, believed.mass
    c["gravity"] = gravity(s.ground.slope)
    c["tilt"] = np.radians(s.ground.slope) if s.ground.angles == "gravity" else 0.0
    c["perturbed"] = run.mass_factor is not None or run.row_factor is not None
    c["mass_factor"] = 1.0 if run.mass_factor is None else run.mass_factor
    c["row_factor"] = 1.0 if run.row_factor is None else run.row_factor
    _set_sensing(c, s)
    if s.backstep is not None:
        c["backstep"], c["margin"], c["theta_back"] = 1, s.backstep.margin, np.radians(s.backstep.theta_l)
        c["k_back"], c["b_back"] = s.backstep.k_d2, s.backstep.b_d2
    actuation = s.actuation
    c["generalized"] = actuation.mode == "generalized"
    c["release"] = actuation.contacts == "released"
    c["release_force"] = actuation.release_force
    c["single_tangential"] = actuation.single_tangential
    c["tolerance"] = actuation.rank_tolerance
    c["limit"] = torque_limits(s)
    c["bounded"] = actuation.limit == "bounded"
    c["use_u_0"] = actuation.null_torque is not None
    c["u_0"] = actuation.null_torque or 0.0
    c["fall_height"] = s.fall.height * run.q[1]
    c["fall_tilt"] = np.radians(s.fall.tilt)
    return out


def _set_sensing(c, s: Scenario) -> None:
    sensing = s.sensing
    c["contact_height"], c["knee_angle"] = sensing.contact_height, sensing.knee_angle
    holds = (sensing.heel_on, sensing.heel_off, sensing.toe_on, sensing.toe_off)
    c["hold"] = [round(hold * s.simulation.control_rate) for hold in holds]
    c["extended"], c["ahead"], c["late_stance"] = (
        sensing.extended,
        sensing.ahead,
        np.radians(sensing.late_stance),
    )


class Law(Protocol):
    """What an engine needs of a control law.

    Attributes:
        u: (6,) joint torques of the latest tick [N m].
        Q_d: (9,) desired generalized forces of the latest tick.
    """

    u: np.ndarray
    Q_d: np.ndarray

    @property
    def tick(self) -> Tick:
        """One control tick (k, time [s]) from the bound measurements; returns a status of `biped.control.tick`."""
        ...


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
        self.u, self.Q_d = self.c["u"], self.c["Q_d"]
        model = believed_model(run.model, run.scenario.ground.slope)
        self.tick = self._bound(model, q, v, log)
        if self.c["bounded"]:
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
        if self.c["over"] and status != NOT_FINITE:
            from biped.control.bounded import bounded_torques

            self.u[:] = bounded_torques(self.c)
            log_tick(self.record, q, v, log, k, time)
        return status
