"""A law of a robot of any kind: found by name, in the user's file or handed over; asked at every tick; checked."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn, Protocol, get_args

import mujoco
import numpy as np

from biped.base.errors import InputError
from biped.base.files import label
from biped.control.general.sensed import Sensed
from biped.control.law import Raised, Signals, numbers
from biped.control.loading import in_words, interrupts, load_law, said, signal_names
from biped.robot.build import Command
from biped.robot.robot import Robot
from biped.robot.run import Run
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario
from biped.scenario.laws import BUILT_IN, own_law


@dataclass(frozen=True)
class Setup:
    """What a law is told before the run.

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


class Law(Protocol):
    """What a law must be. Its class is called with a `Setup` before every run.

    It may have a class attribute `command`, which says what `torques` returns: "torque" [N m] of every actuator's joint
    (the default); "position" or "velocity", targets [rad, rad/s] of servos there; or "generalized", a force (nv,) for
    every velocity, which no robot can do. And `signals`, a dict of numbers that are logged.
    """

    def torques(self, sensed: Sensed) -> np.ndarray:
        """(nu,) what its actuators are commanded, until the next tick."""
        ...


def maker_of(run: Run) -> tuple[Callable[[Setup], Any], str, str]:
    """What makes the run's law, what it is called in errors, and the file of its lines.

    Raises:
        InputError: The user's file is not trusted or cannot be loaded.
    """
    law, given = run.scenario.law or "", run.law
    if given is not None:
        return given.make, f"law: {given.name.rpartition(':')[2]}", given.file
    if not own_law(law):
        module, _, kind = BUILT_IN[law].place.partition(":")
        found = import_module(module)
        return getattr(found, kind), f"law: {law}", found.__file__ or ""
    file, _, kind = law.rpartition(":")
    return load_law(law, run.scenario.law_sha256), f"law: {label(Path(file))}:{kind}", file


def command_of(make: Any, scenario: Scenario, name: str) -> Command:
    """What a law returns.

    Raises:
        InputError: Nothing that it can.
    """
    said_so: Any = getattr(make, "command", "torque")
    command: Any = said_so(scenario) if callable(said_so) else said_so
    if command not in get_args(Command):
        raise InputError(f"{name}: command: expected one of {', '.join(get_args(Command))}, got {command!r:.60}", "law")
    return command


class Asked:
    """A law that is asked at every tick.

    Args:
        make: Makes it.
        name: What it is called in errors.
        file: The file of its lines.
        setup: What it is told.
        size: How many numbers it must return.
        count: Ticks of the run.

    Attributes:
        law: What was made.
        signals: What it logs of its own.

    Raises:
        InputError: It cannot be made.
    """

    def __init__(self, make: Callable[[Setup], Any], name: str, file: str, setup: Setup, size: int, count: int):
        self._name, self._file, self._size, self._robot = name, file, size, setup.robot
        try:
            self.law = make(setup)
            torques, signals = getattr(self.law, "torques", None), getattr(self.law, "signals", {})
        except InputError:
            raise
        except BaseException as error:
            if interrupts(error):
                raise
            what = f"{name}: {name.rpartition(':')[2].strip()}(setup) raised {said(error, file)}"
            raise InputError(what, "law") from error
        if not callable(torques):
            raise InputError(f"{name}: expected a method torques(sensed) that returns {size} numbers", "law")
        names = signal_names(signals, lambda what: InputError(f"{name}: {what}", "law"))
        self.signals = Signals(names, np.full((count if names else 0, len(names)), np.nan))

    def ask(self, k: int, sensed: Sensed) -> np.ndarray:
        """(size,) what it commands at tick k.

        Raises:
            Raised: It raised, or returned something else.
        """
        time = sensed.time
        try:
            told = self.law.torques(sensed)
        except BaseException as error:
            if interrupts(error):
                raise
            self._fail(k, time, f"raised {type(error).__name__}", said(error, self._file), error)
        try:
            out = numbers(told)
        except BaseException as error:
            if interrupts(error):
                raise
            self._fail(k, time, _NOTHING, f"expected {self._size} numbers, got {in_words(repr, told):.100}")
        if out.shape != (self._size,):
            got = "nothing" if told is None else f"shape {out.shape}"
            self._fail(k, time, _NOTHING, f"expected {self._size} numbers, got {got}")
        if not np.isfinite(out).all():
            self._fail(k, time, _NOTHING, f"expected finite numbers, got {out.tolist()!s:.200}")
        if self.signals.names:
            self._note(k, time)
        return out

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
        told = "" if error is None else "".join(traceback.format_exception(error))
        words = f": {why}" if error is None else f" raised {why}"
        raise Raised(
            f"{self._name}: torques() at t = {time:g} s{words}", k, f"{self._name} {what} at {time:.3f} s: {why}", told
        ) from error


_NOTHING = "returned no torques"
