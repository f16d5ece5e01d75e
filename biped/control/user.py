"""A control law of the user's own, from a Python file: what it is told, what it senses, what it must return."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.base.trust import refusal, trusted
from biped.control.law import WORLD
from biped.control.setup import controller_record
from biped.control.tick import NOT_FINITE, log_tick, sense_in
from biped.robot.description import robot_at
from biped.robot.model import believed_model
from biped.robot.run import Run
from biped.robot.topology import NU, UPRIGHT
from biped.robot.tree import Tree
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario
from biped.scenario.law import changed_since


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
        self._motors = robot_at(run.model).actuators
        self._model = believed_model(run.model, s.ground.slope)
        self._data = self._model.createData()
        self._q, self._v, self._log = _read_only(q), _read_only(v), log
        parts = {"rate": "at", "height": "tick", "believed": "memory"}
        self._live = {key: _read_only(self.c[part][key]) for key, part in parts.items()}
        limit = np.array(self.c["actuation"]["limit"])
        setup = Setup(s, run.gains, believed, self._model, 1.0 / s.simulation.control_rate, limit)
        kind = load_law(s.law or "", s.law_sha256) if given is None else given.make
        try:
            self._law = kind(setup)
        except (Exception, SystemExit) as error:
            raise self._fault(f"{kind_name}(setup) raised {_said(error, self.file)}") from error
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
        status = sense_in(self.record, self._data.J, self._q, self._v, k == 0)
        if status == NOT_FINITE:
            return status
        upright = np.array(UPRIGHT) * np.pi
        sensed = Sensed(
            time, self._q, self._v, c["at"]["angle"] + upright + c["belief"]["tilt"],
            live["rate"], live["height"], live["believed"],
            c["memory"]["phase"] + 1, np.triu(M) + np.triu(M, 1).T,
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
        if u.shape != (NU,):
            got = "nothing" if said is None else f"shape {u.shape}"
            raise self._fault(f"torques() at t = {time:g} s: expected six numbers [N m], got {got}")
        if not np.isfinite(u).all():
            joint = self._motors[int(np.argmin(np.isfinite(u)))]
            raise self._fault(f"torques() at t = {time:g} s: expected finite numbers, got {u.tolist()} ({joint} first)")
        np.clip(u, -c["actuation"]["limit"], c["actuation"]["limit"], out=self.u)
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


def _forget(names: set[str], folder: Path) -> None:
    """Forgets helpers from a law's folder: one of the same name beside the next law is another one."""
    for name in names:
        origin = getattr(sys.modules[name], "__file__", None)
        if origin and Path(origin).is_relative_to(folder):
            del sys.modules[name]


def load_law(law: str, sha256: str | None = None) -> type:
    """The class that `path.py:Class` names.

    Args:
        law: File and class.
        sha256: What the law must be (`biped.scenario.law.digest`); None: whatever it is.

    Raises:
        InputError: The file is not trusted, has changed, cannot be imported or has no such class.
    """
    file, _, name = law.rpartition(":")
    shown = label(Path(file))
    # The one door that every law goes through: whoever forgets to ask earlier ends here.
    if not trusted(Path(file)):
        raise InputError(f"law: {refusal(Path(file))}", "law")
    if changed := changed_since(law, sha256):
        raise InputError(f"law: {changed}", "law")
    spec = importlib.util.spec_from_file_location(f"biped_law_{Path(file).stem}", file)
    if spec is None:
        raise InputError(f"law: {shown} cannot be loaded as a Python file", "law")
    module = importlib.util.module_from_spec(spec)
    # Dataclasses and pickle look a class's module up by name; helpers may lie beside the file.
    sys.modules[spec.name] = module
    before = set(sys.modules)
    sys.path.append(str(Path(file).parent))
    try:
        # What is read is what runs: the loader would prefer compiled code that lies beside it.
        exec(compile(Path(file).read_bytes(), file, "exec", dont_inherit=True), module.__dict__)
    except (Exception, SystemExit) as error:
        raise InputError(f"law: importing {shown} raised {_said(error, file)}", "law") from error
    finally:
        sys.path.pop()
        _forget(set(sys.modules) - before, Path(file).parent)
    kind = getattr(module, name, None)
    if not isinstance(kind, type):
        there = [n for n, value in vars(module).items() if isinstance(value, type)]
        raise InputError(f"law: {shown} has no class '{name}'; {nearest(name, there)}", "law")
    return kind
