"""A control law of the user's own, from a Python file: what it is told, what it senses, what it must return."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np
import pinocchio

from biped.base.errors import InputError
from biped.base.files import label
from biped.control.law import Raised, Signals, numbers
from biped.control.loading import in_words, interrupts, load_law, said, signal_names
from biped.control.offered import offer
from biped.control.setup import controller_record
from biped.control.tick import NOT_FINITE, log_tick, sense_in
from biped.robot.planar.controller_model import believed_model
from biped.robot.planar.topology import N_POINTS, N_ROWS, N_STOPS, NQ, NU, STOP_ROW, TOE, UPRIGHT
from biped.robot.planar.tree import Tree
from biped.robot.robot import Robot
from biped.robot.run import Run
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario


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
        robot: The biped, with names of its bodies, coordinates (`q_names`), actuators and points.
    """

    scenario: Scenario
    gains: Gains
    tree: Tree
    model: pinocchio.Model
    tick: float
    torque_limit: np.ndarray
    robot: Robot


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
        J: (10, 9) rows of all constraints: normal and tangential (along the ground) of each point, then the knees'.
        b_v: (10,) -J̇v of these rows.
        touching: (6,) which constraints touch (0 or 1): the four points, then right and left knee at its stop.
        Q_d: (9,) generalized forces of the gait's springs and dampers.
        single_tangential: Whether a flat foot has one tangential row, its heel's.
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
    J: np.ndarray
    b_v: np.ndarray
    touching: np.ndarray
    Q_d: np.ndarray
    single_tangential: bool = False

    @property
    def rows(self) -> list[int]:
        """Rows of J that A consists of: those of whatever touches."""
        points = [i for i in range(N_POINTS) if self.touching[i]]
        return self.rows_of(points) + [STOP_ROW + leg for leg in range(N_STOPS) if self.touching[N_POINTS + leg]]

    def rows_of(self, points: Sequence[int]) -> list[int]:
        """Rows of J of some of the four points, normal and tangential."""
        spared = [i for i in points if self.single_tangential and i in TOE and i + 1 in points]
        return [2 * i + direction for i in points for direction in range(2) if direction == 0 or i not in spared]

    @property
    def A(self) -> np.ndarray:
        """(m, 9) constraint Jacobian of whatever touches, before any release test: A v̇ = b_v[rows]."""
        return self.J[self.rows]


class UserLaw:
    """A law from a Python file or handed over as an object; sensing, leg states, limits and log are the thesis's.

    Args:
        run: Scenario, gains and draws; `run.scenario.law` is `path.py:Class`, or `run.law` makes it.
        believed: Lengths the controller believes in.
        q: (9,) measured joint coordinates, live.
        v: (9,) measured joint velocities, live.
        log: (n, WIDTH) log that ticks write.

    Raises:
        InputError: The file cannot be loaded, has no such class, or the class cannot be made.
    """

    def __init__(self, run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray):
        s = run.scenario
        file, _, kind_name = (s.law or "").rpartition(":")
        given = run.law
        self.file = file if given is None else given.file
        self.name = f"law: {label(Path(file))}:{kind_name}" if given is None else f"law: {kind_name}"
        self.record = controller_record(run, believed)
        self.c = self.record[0]
        self.u, self.Q_d = self.c["tick"]["u"], self.c["tick"]["Q_d"]
        robot = run.robot
        self._motors = robot.actuators
        self._model = believed_model(run.model, s.ground.slope)
        self._data = self._model.createData()
        self._q, self._v, self._log = _read_only(q), _read_only(v), log
        parts = {"rate": "at", "height": "tick", "believed": "memory"}
        self._live = {key: _read_only(self.c[part][key]) for key, part in parts.items()}
        self._rows = np.zeros((N_ROWS, NQ)), np.zeros(N_ROWS)
        J, b_v, touching = (_read_only(a) for a in (*self._rows, self.c["tick"]["active"]))
        self._offered = {"J": J, "b_v": b_v, "touching": touching, "Q_d": _read_only(self.Q_d)}
        limit = np.array(self.c["actuation"]["limit"])
        setup = Setup(s, run.gains, believed, self._model, 1.0 / s.simulation.control_rate, limit, robot)
        kind = load_law(s.law or "", s.law_sha256) if given is None else given.make
        try:
            self._law = kind(setup)
            torques, signals = getattr(self._law, "torques", None), getattr(self._law, "signals", {})
        except BaseException as error:
            if interrupts(error):
                raise
            raise self._fault(f"{kind_name}(setup) raised {said(error, self.file)}") from error
        if not callable(torques):
            raise self._fault("expected a method torques(sensed) that returns six torques [N m]")
        names = signal_names(signals, self._fault)
        self.signals = Signals(names, np.full((len(log) if names else 0, len(names)), np.nan))

    def _fault(self, what: str) -> InputError:
        return InputError(f"{self.name}: {what}", "law")

    def tick(self, k: int, time: float) -> int:
        """See `Law`.

        Raises:
            Raised: The user's law raised, or returned something other than six finite numbers.
        """
        pinocchio.crba(self._model, self._data, self._q, pinocchio.Convention.WORLD)
        M = self._data.M
        c, live = self.c, self._live
        status = sense_in(self.record, self._data.J, self._q, self._v, k == 0)
        if status == NOT_FINITE:
            return status
        offer(self.record, self._q, self._v, *self._rows)
        upright = np.array(UPRIGHT) * np.pi
        sensed = Sensed(
            time, self._q, self._v, c["at"]["angle"] + upright + c["belief"]["tilt"],
            live["rate"], live["height"], live["believed"],
            c["memory"]["phase"] + 1, np.triu(M) + np.triu(M, 1).T,
            pinocchio.nonLinearEffects(self._model, self._data, self._q, self._v),
            **self._offered, single_tangential=bool(c["actuation"]["single_tangential"]),
        )  # fmt: skip
        try:
            told = self._law.torques(sensed)
        except BaseException as error:
            if interrupts(error):
                raise
            self._fail(k, time, f"raised {type(error).__name__}", said(error, self.file), error)
        try:
            u = numbers(told)
        except BaseException as error:
            if interrupts(error):
                raise
            self._fail(k, time, _NO_TORQUES, f"expected six numbers [N m], got {in_words(repr, told):.100}")
        if u.shape != (NU,):
            got = "nothing" if told is None else f"shape {u.shape}"
            self._fail(k, time, _NO_TORQUES, f"expected six numbers [N m], got {got}")
        if not np.isfinite(u).all():
            joint = self._motors[int(np.argmin(np.isfinite(u)))]
            self._fail(k, time, _NO_TORQUES, f"expected finite numbers, got {u.tolist()} ({joint} first)")
        np.clip(u, -c["actuation"]["limit"], c["actuation"]["limit"], out=self.u)
        log_tick(self.record, self._q, self._v, self._log, k, time)
        if self.signals.names:
            self._note(k, time)
        return status

    def _note(self, k: int, time: float) -> None:
        """Logs the law's own signals of a tick."""
        try:
            values = self._law.signals
            self.signals.values[k] = [values[name] for name in self.signals.names]
        except BaseException as error:
            if interrupts(error):
                raise
            self._fail(
                k, time, "left no signals", f"expected numbers of the names it began with: {in_words(repr, error):.100}"
            )

    def _fail(self, k: int, time: float, what: str, why: str, error: BaseException | None = None) -> NoReturn:
        """Ends the run.

        Raises:
            Raised: Always.
        """
        told = "" if error is None else "".join(traceback.format_exception(error))
        words = f": {why}" if error is None else f" raised {why}"
        raise Raised(
            f"{self.name}: torques() at t = {time:g} s{words}", k, f"{self.name} {what} at {time:.3f} s: {why}", told
        ) from error


_NO_TORQUES = "returned no torques"


def _read_only(array: np.ndarray) -> np.ndarray:
    """A live view that a law cannot write through: changing what it senses would change the physics."""
    view = array.view()
    view.flags.writeable = False
    return view
