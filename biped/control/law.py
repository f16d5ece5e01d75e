"""A law of a robot of any kind: found by name, in the user's file or handed over; asked at every tick; checked.

A file of the user's own is loaded if it is trusted, apart from every other law, and blamed by line.
"""

import importlib.util
import math
import re
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, Protocol, get_args

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label, nearest
from biped.base.trust import refusal, trusted
from biped.control.observation import Observation
from biped.robot.build import Command
from biped.robot.robot import Robot
from biped.robot.run import Run
from biped.scenario.card import read_card
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario
from biped.scenario.laws import BUILT_IN, changed_since, is_card, own_law

MOST_SIGNALS = 64
"""Of a law's own."""


def signal_names(signals: Any, fault: Callable[[str], InputError]) -> tuple[str, ...]:
    """Names of a law's own signals, which it has when it is made.

    Args:
        signals: What it has.
        fault: Makes the error.

    Raises:
        InputError: They are not names of numbers.
    """
    if not isinstance(signals, dict):
        raise fault(f"signals: expected a dict of names and numbers, got {in_words(repr, signals):.60}")
    for name in signals:
        if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z]\w{0,59}", name, re.ASCII):
            raise fault(f"signals: expected names of letters, digits and _, got {in_words(repr, name):.80}")
    if len(signals) > MOST_SIGNALS:
        raise fault(f"signals: expected at most {MOST_SIGNALS}, got {len(signals)}")
    return tuple(signals)


def error_text(error: BaseException, file: str) -> str:
    """An exception in words, with the line of the user's file that it came from."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    where = f" ({Path(file).name}, line {lines[-1]})" if lines else ""
    return f"{type(error).__name__}: {' '.join(in_words(str, error).split())}{where}"


def in_words(words: Callable[[object], str], value: object) -> str:
    """A law's value or exception in words, even where its own `__str__` or `__repr__` raises."""
    try:
        return f"{words(value):.2000}"
    except BaseException as error:
        if interrupts(error):
            raise
        return f"({type(value).__name__} without words: {words.__name__}() of it raised {type(error).__name__})"


def interrupts(error: BaseException) -> bool:
    """Whether an exception is the user's Ctrl-C; a worker process and a thread never hear it: there a law raised it."""
    hears = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) != signal.SIG_IGN
    return isinstance(error, KeyboardInterrupt) and hears


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
        sha256: What the law must be (`biped.scenario.laws.digest`); None: whatever it is.

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
    except BaseException as error:
        if interrupts(error):
            raise
        raise InputError(f"law: importing {shown} raised {error_text(error, file)}", "law") from error
    finally:
        sys.path.pop()
        _forget(set(sys.modules) - before, Path(file).parent)
    kind = getattr(module, name, None)
    if not isinstance(kind, type):
        there = [n for n, value in vars(module).items() if isinstance(value, type)]
        raise InputError(f"law: {shown} has no class '{name}'; {nearest(name, there)}", "law")
    return kind


_GIVEN_UP = "given_up"


class Signals(NamedTuple):
    """A signal that a law logs of its own.

    Attributes:
        names: Of its signals.
        values: (n, len(names)) one row per tick, nan where it said nothing.
    """

    names: tuple[str, ...]
    values: np.ndarray

    def unsolved(self, rows: int) -> int:
        """The number of ticks, of the first so many, in which a law says by `given_up` that it solved no problem."""
        return int((self.values[:rows, self.names.index(_GIVEN_UP)] > 0.0).sum()) if _GIVEN_UP in self.names else 0


NO_SIGNALS = Signals((), np.empty((0, 0)))


class Raised(InputError):
    """A law that failed at a tick: before the first there is nothing to keep, afterwards the run ends there.

    Args:
        message: One paragraph.
        tick: Number of the tick.
        cause: How the run ended, in words that end in the time and the reason.
        traceback: Where in the law, as Python says it; empty if it did not raise.
    """

    def __init__(self, message: str, tick: int, cause: str, traceback: str):
        super().__init__(message, "law")
        self.tick, self.cause, self.traceback = tick, cause, traceback


@dataclass(frozen=True)
class Setup:
    """Facts of the run that a law gets before it begins.

    Attributes:
        scenario: The scenario.
        gains: Of its gait file, if it names one; otherwise each is None.
        robot: What the robot is: names of its coordinates, actuators and feet.
        model: A copy of what MuJoCo steps, as the model file says it and on level ground.
        path: The model file.
        tick: [s] between calls.
        torque_limit: (nu,) [N m].
        q: (nq,) coordinates that the run starts with.
        v: (nv,) velocities.
        seed: Of the run, for what a law draws (`biped.scenario.vary.stream`).
    """

    scenario: Scenario
    gains: Gains
    robot: Robot
    model: mujoco.MjModel
    path: Path
    tick: float
    torque_limit: np.ndarray
    q: np.ndarray
    v: np.ndarray
    seed: int = 0

    @property
    def observed(self) -> list[str]:
        """Names of all `numbers` of an observation."""
        return Observation.names_of(self.robot)


class Law(Protocol):
    """The protocol of a law. Its class is called with a `Setup` before every run.

    It may have a class attribute `command`, which says what `torques` returns: "torque" [N m] of every actuator's joint
    (the default); "position" or "velocity", targets [rad, rad/s] of servos there; or "generalized", a force (nv,) for
    every velocity, which no robot can do. And `signals`, a dict of numbers that are logged.
    """

    def torques(self, sensed: Observation) -> np.ndarray:
        """(nu,) what its actuators are commanded, until the next tick."""
        ...


def maker_of(run: Run) -> tuple[Callable[[Setup], Any], str, str]:
    """The maker of the run's law, its name in errors, and the file of its lines.

    Raises:
        InputError: The user's file is not trusted or cannot be loaded.
    """
    law, given = run.scenario.law or "", run.law
    if given is not None:
        return given.make, f"law: {given.name.rpartition(':')[2]}", given.file
    if is_card(law):
        file = Path(law)
        if changed := changed_since(law, run.scenario.law_sha256):
            raise InputError(f"law: {changed}", "law")
        return import_module("biped.control.card").Networked(read_card(file), file), f"law: {label(file)}", law
    if not own_law(law):
        module, _, kind = BUILT_IN[law].place.partition(":")
        found = import_module(module)
        return getattr(found, kind), f"law: {law}", found.__file__ or ""
    file, _, kind = law.rpartition(":")
    return load_law(law, run.scenario.law_sha256), f"law: {label(Path(file))}:{kind}", file


def command_of(make: Any, scenario: Scenario, name: str) -> Command:
    """The action that a law returns.

    Raises:
        InputError: Nothing that it can.
    """
    said_so: Any = getattr(make, "command", "torque")
    command: Any = said_so(scenario) if callable(said_so) else said_so
    if command not in get_args(Command):
        raise InputError(f"{name}: command: expected one of {', '.join(get_args(Command))}, got {command!r:.60}", "law")
    return command


class Commander:
    """A law of any robot: made before the run, called at every tick, and held to finite numbers.

    Args:
        make: Makes it.
        name: What it is called in errors.
        file: The file of its lines.
        setup: What is known before the run.
        size: How many numbers it must return.
        count: Ticks of the run.

    Attributes:
        law: What was made.
        size: As given.
        signals: What it logs of its own.

    Raises:
        InputError: It cannot be made.
    """

    def __init__(self, make: Callable[[Setup], Any], name: str, file: str, setup: Any, size: int, count: int):
        self._name, self._file, self.size, self._robot = name, file, size, setup.robot
        try:
            self.law = make(setup)
            torques, signals = getattr(self.law, "torques", None), getattr(self.law, "signals", {})
        except InputError:
            raise
        except BaseException as error:
            if interrupts(error):
                raise
            what = f"{name}: {name.rpartition(':')[2].strip()}(setup) raised {error_text(error, file)}"
            raise InputError(what, "law") from error
        if not callable(torques):
            raise InputError(f"{name}: expected a method torques(sensed) that returns {size} numbers", "law")
        names = signal_names(signals, lambda what: InputError(f"{name}: {what}", "law"))
        self.signals = Signals(names, np.full((count if names else 0, len(names)), np.nan))

    def command(self, k: int, sensed: Any) -> np.ndarray:
        """(size,) what it commands at tick k; whether that is finite is for whoever applies it (`refuse`).

        Raises:
            Raised: It raised, or returned something else.
        """
        try:
            out = self.law.torques(sensed)
        except BaseException as error:
            if interrupts(error):
                raise
            self._fail(k, sensed.time, f"raised {type(error).__name__}", error_text(error, self._file), error)
        if type(out) is not np.ndarray or out.dtype != np.float64 or out.shape != (self.size,):
            out = self._numbers(k, sensed.time, out)
        if self.signals.names:
            self._note(k, sensed.time)
        return out

    def _numbers(self, k: int, time: float, command: object) -> np.ndarray:
        """(size,) what a law returned, as floats."""
        try:
            out = numbers(command)
        except BaseException as error:
            if interrupts(error):
                raise
            self._fail(k, time, _NOTHING, f"expected {self.size} numbers, got {in_words(repr, command):.100}")
        if out.shape != (self.size,):
            got = "nothing" if command is None else f"shape {out.shape}"
            self._fail(k, time, _NOTHING, f"expected {self.size} numbers, got {got}")
        return out

    def refuse(self, k: int, time: float, command: np.ndarray) -> NoReturn:
        """Ends a run whose law commanded something that is not finite.

        Raises:
            Raised: Always.
        """
        robot = self._robot
        names = robot.actuators if self.size == len(robot.actuators) else robot.v_names
        wrong = ", ".join(f"{value} for {name}" for name, value in zip(names, command.tolist(), strict=True)
                          if not math.isfinite(value))  # fmt: skip
        self._fail(k, time, _NOTHING, f"expected finite numbers, got {wrong:.200}")

    def _note(self, k: int, time: float) -> None:
        try:
            self.signals.values[k] = [self.law.signals[name] for name in self.signals.names]
        except BaseException as error:
            if interrupts(error):
                raise
            self._fail(
                k, time, "left no signals", f"expected numbers of the names it began with: {in_words(repr, error):.100}"
            )

    def _fail(self, k: int, time: float, what: str, why: str, error: BaseException | None = None) -> NoReturn:
        trace = "" if error is None else "".join(traceback.format_exception(error))
        words = f": {why}" if error is None else f" raised {why}"
        raise Raised(
            f"{self._name}: torques() at t = {time:g} s{words}", k, f"{self._name} {what} at {time:.3f} s: {why}", trace
        ) from error


_NOTHING = "returned no torques"


def numbers(told: object) -> np.ndarray:
    """An action as an array of floats.

    Raises:
        TypeError: It is not of real numbers: nothing imaginary, masked or in words passes as what it is not.
        ValueError: It has no shape.
    """
    found = np.asarray(told)
    if found.dtype.kind not in "biufO" or np.ma.is_masked(told):
        raise TypeError(f"numbers of {found.dtype}")
    return found.astype(float, copy=False)
