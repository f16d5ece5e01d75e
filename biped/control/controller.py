"""The control laws: the thesis's, compiled, and the protocol that a user's own law implements.

A law is bound to the measured coordinates of one run and ticks through it; what it wants is left in `u` and `Q_d`.
"""

from __future__ import annotations

import importlib.util
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import pinocchio

from biped.control import record
from biped.control.tick import NOT_FINITE, log_tick, sense, thesis_tick
from biped.errors import InputError
from biped.files import label, nearest
from biped.geometry import ACTUATORS, Tree
from biped.model import believed_model, torque_limits
from biped.plan import Run
from biped.scenario import Gains, Scenario

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
    c["point"] = believed.point
    c["tilt"] = np.radians(s.ground.slope) if s.ground.angles == "gravity" else 0.0
    c["perturbed"] = run.mass_factor is not None or run.row_factor is not None
    c["mass_factor"] = 1.0 if run.mass_factor is None else run.mass_factor
    c["row_factor"] = 1.0 if run.row_factor is None else run.row_factor
    _set_sensing(c, s)
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


class Law(Protocol):
    """What an engine needs of a control law.

    Attributes:
        u: (6,) joint torques of the latest tick [N m].
        Q_d: (9,) desired generalized forces of the latest tick.
    """

    u: np.ndarray
    Q_d: np.ndarray

    def tick(self, k: int, time: float) -> int:
        """One control tick from the bound measurements; returns a status of `biped.control.tick`."""
        ...


class ThesisLaw:
    """Braun & Goldfarb's law: Pinocchio's M, bias and Jacobians, then one compiled tick.

    Args:
        run: Scenario, gains and draws.
        believed: Lengths the controller believes in.
        q: (9,) measured joint coordinates, live.
        v: (9,) measured joint velocities, live.
        log: (n, WIDTH) log that ticks write.
    """

    def __init__(self, run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray):
        self.record = controller_record(run, believed)
        self.c = self.record[0]
        self.u, self.Q_d = self.c["u"], self.c["Q_d"]
        self._model = believed_model(run.model, run.scenario.ground.slope)
        self._data = self._model.createData()
        self._q, self._v, self._log = q, v, log
        self._M, self._J = self._data.M, self._data.J
        self._bounded = bool(self.c["bounded"])

    def tick(self, k: int, time: float) -> int:
        """See `Law`."""
        # crba fills M (upper triangle) and J; nothing else of Pinocchio's dynamics is needed.
        pinocchio.crba(self._model, self._data, self._q, WORLD)
        h = pinocchio.nonLinearEffects(self._model, self._data, self._q, self._v)
        status = thesis_tick(self.record, self._M, self._J, h, self._q, self._v, self._log, k, time)
        if self._bounded and self.c["over"] and status != NOT_FINITE:
            from biped.control.bounded import bounded_torques

            self.u[:] = bounded_torques(self.c)
            log_tick(self.record, self._q, self._v, self._log, k, time)
        return status


@dataclass(frozen=True)
class Setup:
    """What a user's law is told before the run.

    Attributes:
        scenario: The scenario.
        gains: The gait file's gains; a law may use or ignore them.
        tree: Lengths and masses of the model file.
        model: Pinocchio's model of it.
        tick: [s] between calls.
        torque_limit: (6,) [N m].
    """

    scenario: Scenario
    gains: Gains
    tree: Tree
    model: pinocchio.Model
    tick: float
    torque_limit: np.ndarray


@dataclass
class Sensed:
    """What a user's law senses at a tick; arrays are live and cannot be changed.

    Attributes:
        time: [s].
        q: (9,) joint coordinates [m, rad]: torso x, z, pitch, then hip, knee, ankle, right and left.
        v: (9,) joint velocities.
        angle: (7,) absolute link angles in the thesis's sense [rad]: torso, thigh, shank, foot, thigh, shank, foot.
        rate: (7,) their rates [rad/s].
        height: (4,) [m] of right toe, right heel, left toe, left heel.
        contact: (4,) believed contacts (0 or 1).
        state: (2,) leg states 1 … 4, right and left.
        M: (9, 9) mass matrix.
        h: (9,) bias forces, gravity included.
    """

    time: float
    q: np.ndarray
    v: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    height: np.ndarray
    contact: np.ndarray
    state: np.ndarray
    M: np.ndarray
    h: np.ndarray


class UserLaw:
    """A law from a Python file, with the same sensing, leg states, limits and log as the thesis's.

    Args:
        run: Scenario, gains and draws; `run.scenario.law` is `path.py:Class`.
        believed: Lengths the controller believes in.
        q: (9,) measured joint coordinates, live.
        v: (9,) measured joint velocities, live.
        log: (n, WIDTH) log that ticks write.

    Raises:
        InputError: The file cannot be loaded, has no such class, or the class cannot be made.
    """

    def __init__(self, run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray):
        s = run.scenario
        self.file, _, kind_name = s.law.rpartition(":")
        self.name = f"law: {label(Path(self.file))}:{kind_name}"
        self.record = controller_record(run, believed)
        self.c = self.record[0]
        self.u, self.Q_d = self.c["u"], self.c["Q_d"]
        self._model = believed_model(run.model, s.ground.slope)
        self._data = self._model.createData()
        self._q, self._v, self._log = _read_only(q), _read_only(v), log
        self._live = {key: _read_only(self.c[key]) for key in ("rate", "height", "believed")}
        setup = Setup(s, run.gains, believed, self._model, 1.0 / s.simulation.control_rate, np.array(self.c["limit"]))
        kind = load_law(s.law)
        try:
            self._law = kind(setup)
        except (Exception, SystemExit) as error:
            raise self._fault(f"{kind.__name__}(setup) raised {_said(error, self.file)}") from error
        if not callable(getattr(self._law, "torques", None)):
            raise self._fault("expected a method torques(sensed) that returns six torques [N m]")

    def _fault(self, what: str) -> InputError:
        return InputError(f"{self.name}: {what}", "law")

    def tick(self, k: int, time: float) -> int:
        """See `Law`.

        Raises:
            InputError: The user's law raised, or returned something other than six finite numbers.
        """
        pinocchio.crba(self._model, self._data, self._q, WORLD)
        M = self._data.M
        c, live = self.c, self._live
        status = sense(self.record, self._data.J, self._q, self._v, k == 0)
        if status == NOT_FINITE:
            return status
        upright = np.array([0.5, 0.5, 0.5, 0.0, 0.5, 0.5, 0.0]) * np.pi
        sensed = Sensed(
            time, self._q, self._v, c["angle"] + upright + c["tilt"], live["rate"], live["height"], live["believed"],
            c["phase"] + 1, np.triu(M) + np.triu(M, 1).T,
            pinocchio.nonLinearEffects(self._model, self._data, self._q, self._v),
        )  # fmt: skip
        try:
            said = self._law.torques(sensed)
        except (Exception, SystemExit) as error:
            raise self._fault(f"torques() at t = {time:g} s raised {_said(error, self.file)}") from error
        try:
            u = np.asarray(said, dtype=float)
        except (TypeError, ValueError):
            raise self._fault(f"torques() at t = {time:g} s: expected six numbers [N m], got {said!r:.100}") from None
        if u.shape != (6,):
            got = "nothing" if said is None else f"shape {u.shape}"
            raise self._fault(f"torques() at t = {time:g} s: expected six numbers [N m], got {got}")
        if not np.isfinite(u).all():
            joint = ACTUATORS[int(np.argmin(np.isfinite(u)))]
            raise self._fault(f"torques() at t = {time:g} s: expected finite numbers, got {u.tolist()} ({joint} first)")
        np.clip(u, -c["limit"], c["limit"], out=self.u)
        log_tick(self.record, self._q, self._v, self._log, k, time)
        return status


def _read_only(array: np.ndarray) -> np.ndarray:
    """A live view that a law cannot write through: changing what it senses would change the physics."""
    view = array.view()
    view.flags.writeable = False
    return view


def _said(error: BaseException, file: str) -> str:
    """An exception in words, with the line of the user's file that it came from."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    where = f" ({Path(file).name}, line {lines[-1]})" if lines else ""
    return f"{type(error).__name__}: {' '.join(str(error).split())}{where}"


def load_law(law: str) -> type:
    """The class that `path.py:Class` names.

    Raises:
        InputError: The file cannot be imported or has no such class.
    """
    file, _, name = law.rpartition(":")
    shown = label(Path(file))
    spec = importlib.util.spec_from_file_location(f"biped_law_{Path(file).stem}", file)
    if spec is None or spec.loader is None:
        raise InputError(f"law: {shown} cannot be loaded as a Python file", "law")
    module = importlib.util.module_from_spec(spec)
    # Dataclasses and pickle look a class's module up by name; helpers may lie beside the file.
    sys.modules[spec.name] = module
    sys.path.append(str(Path(file).parent))
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise InputError(f"law: importing {shown} raised {_said(error, file)}", "law") from error
    finally:
        sys.path.pop()
    kind = getattr(module, name, None)
    if not isinstance(kind, type):
        there = [n for n, value in vars(module).items() if isinstance(value, type)]
        raise InputError(f"law: {shown} has no class '{name}'; {nearest(name, there)}", "law")
    return kind


def law_of(run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray) -> Law:
    """The control law of a run, bound to its measurements and its log."""
    kind = ThesisLaw if run.scenario.law is None else UserLaw
    return kind(run, believed, q, v, log)
