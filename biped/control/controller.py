"""The thesis's control law, compiled, and what an engine needs of any law (a user's own: `biped.control.user`).

A law is bound to the measured coordinates of one run and ticks through it; what it wants is left in `u` and `Q_d`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol

import numpy as np
import pinocchio

from biped.base.jit import bound
from biped.control import record
from biped.control.changes import bring_up_to_date, changes_of
from biped.control.matrices import same_matrices, tree_matrices
from biped.control.tick import NOT_FINITE, log_tick, thesis_tick
from biped.robot.model import believed_model, gravity, torque_limits
from biped.robot.run import Run
from biped.robot.tree import Tree
from biped.scenario.gains import Gains
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
    set_gains(c, run.gains)
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


def set_gains(c, gains: Gains) -> None:
    """Writes a gait into a controller record."""
    c["k_d1"], c["b_d1"], c["theta_b"] = gains.k_d1, gains.b_d1, np.radians(gains.theta_b)
    c["k"] = np.transpose([gains.k_d2, gains.k_d3, gains.k_d4])
    c["b"] = np.transpose([gains.b_d2, gains.b_d3, gains.b_d4])
    c["theta_l"], c["theta_a"] = np.radians(gains.theta_l), np.radians(gains.theta_a)


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


Tick = Callable[[int, float], int]


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
    """Braun & Goldfarb's law: M and Jacobians, then one compiled tick.

    M and Jacobians are the planar tree's where Pinocchio, which read the model file by itself, finds the same numbers;
    otherwise they are Pinocchio's, tick by tick.

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
        compiled: Whether the tick can be part of a compiled loop (`biped.control.loop`).
    """

    def __init__(self, run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray):
        self.record = controller_record(run, believed)
        self.c = self.record[0]
        self.u, self.Q_d = self.c["u"], self.c["Q_d"]
        self.changes = changes_of(run)
        self.tree = believed if same_matrices(run.model, believed) else None
        self.M, self.J = np.zeros((9, 9)), np.zeros((6, 9))
        self.compiled = self.tree is not None and not self.c["bounded"]
        self._bind = run, q, v, log

    @property
    def tick(self) -> Tick:
        """A closure, made anew at every asking: to look up the run's arrays would cost as much as the leg states do."""
        run, q, v, log = self._bind
        record, changes, tree = self.record, self.changes, self.tree
        if tree is None:
            model = believed_model(run.model, run.scenario.ground.slope)
            data = model.createData()
            M, J = data.M, data.J
            matrices = partial(pinocchio.crba, model, data, q, WORLD)  # fills M (upper triangle) and J
        else:
            M, J = self.M, self.J
            matrices = partial(bound(tree_matrices, tree, q, M, J), tree, q, M, J)
        kernel = bound(thesis_tick, record, M, J, q, v, log, 0, 0.0)
        update = bound(bring_up_to_date, record, changes, 0) if len(changes) else None

        def tick(k: int, time: float) -> int:
            if update is not None:
                update(record, changes, k)
            matrices()
            return kernel(record, M, J, q, v, log, k, time)

        return partial(self._bounded_tick, tick, q, v, log) if self.c["bounded"] else tick

    def _bounded_tick(self, tick: Tick, q: np.ndarray, v: np.ndarray, log: np.ndarray, k: int, time: float) -> int:
        """A tick that solves the bounded problem where a torque limit is exceeded."""
        status = tick(k, time)
        if self.c["over"] and status != NOT_FINITE:
            from biped.control.bounded import bounded_torques

            self.u[:] = bounded_torques(self.c)
            log_tick(self.record, q, v, log, k, time)
        return status


def law_of(run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray) -> Law:
    """The control law of a run, bound to its measurements and its log."""
    if run.scenario.law is None:
        return ThesisLaw(run, believed, q, v, log)
    from biped.control.user import UserLaw

    return UserLaw(run, believed, q, v, log)
