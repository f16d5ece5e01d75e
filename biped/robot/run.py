"""One run, concrete: everything random in it is drawn, and everything it needs is in it, a law as an object too."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from copy import copy, deepcopy
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import mujoco
import numpy as np
from msgspec import structs

from biped.base.errors import InputError
from biped.robot.ground import Profile, levelled, profile_of
from biped.robot.planar.build import Foreign, compile_foreign
from biped.robot.planar.order import believed_model, pinocchio_tree
from biped.robot.planar.tree import Tree, true_tree
from biped.robot.robot import Robot, seven_links, torque_limits
from biped.robot.truth import true_robot
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario, Truth
from biped.scenario.valid import UNKNOWN, Origin

if TYPE_CHECKING:
    import pinocchio

    from biped.robot.build import Command, Servo


class Factory(NamedTuple):
    """Makes the law of every run.

    Attributes:
        make: Called with a `biped.control.planar.user.PlanarSetup` or `biped.control.law.Setup` before every run.
        name: What the scenario calls it: `path.py:Class` where a file has it, else a name that no file can have.
        file: The file that its lines are in; empty if there is none.
    """

    make: Callable[[Any], Any]
    name: str
    file: str


class _Copied:
    """Gives every run its own copy of an instance: what one run leaves in it must not reach the next."""

    def __init__(self, instance: Any):
        self.instance = instance

    def __call__(self, setup: Any) -> Any:
        return deepcopy(self.instance)


def factory_of(law: Any) -> Factory:
    """Returns the factory that makes the law of every run.

    Args:
        law: A class, a function that makes a law from a `Setup`, or an instance with a method `torques`.

    Raises:
        InputError: It is none of these.
    """
    if isinstance(law, Factory):
        return law
    if not isinstance(law, type) and callable(getattr(law, "torques", None)):
        return Factory(_Copied(law), f"python:{type(law).__qualname__}", _file(type(law)))
    if not callable(law):
        raise InputError(
            f"law: expected a class, a function or an instance with a method torques(sensed), got {law!r:.60}", "law"
        )
    name, file = getattr(law, "__qualname__", type(law).__qualname__), _file(law)
    plain = isinstance(law, type) and name.isidentifier() and file.endswith(".py") and Path(file).is_file()
    return Factory(law, f"{Path(file).resolve()}:{name}" if plain else f"python:{name}", file)


def _file(kind: Any) -> str:
    try:
        return inspect.getsourcefile(kind) or ""
    except (OSError, TypeError):  # a prompt's or a notebook's
        return ""


@dataclass(frozen=True, eq=False)
class Run:
    """One run, concrete.

    Attributes:
        scenario: Its scenario with the values of its point and its draws.
        model: The model file.
        robot: The robot in it, as the file says.
        gains: The gait, complete.
        index: Number in the campaign.
        seed: Its own seed.
        values: What its point of the sweep and its draws changed, by key.
        q: (nq,) coordinates that it starts from [m, rad], in the order of `robot.q_names`.
        v: (nv,) velocities that it starts with, in the order of `robot.v_names`.
        mass_factor: (9, 9) elementwise factors of the controller's M, or None where none are fixed for the run.
        row_factor: (10, 9) elementwise factors of the controller's A, likewise.
        origin: Where the keys of its scenario were written.
        law: Makes the run's own law where one was handed over as an object (`biped.robot.run`).
        edit: Changes the compiled MuJoCo model that engines but home's step, of which the law knows nothing; for
            studies of causes that no key of a scenario names.
    """

    scenario: Scenario
    model: Path
    robot: Robot
    gains: Gains
    index: int
    seed: int
    values: dict[str, Any]
    q: np.ndarray
    v: np.ndarray
    mass_factor: np.ndarray | None = None
    row_factor: np.ndarray | None = None
    origin: Origin = UNKNOWN
    law: Factory | None = None
    edit: Callable[[mujoco.MjModel], None] | None = None

    @property
    def tick(self) -> float:
        """[s] between two ticks of the law."""
        return 1.0 / self.scenario.simulation.control_rate

    @property
    def ticks(self) -> int:
        """Number of ticks of a run that does not end early."""
        return round(self.scenario.duration * self.scenario.simulation.control_rate)

    @property
    def substeps(self) -> int:
        """Number of steps of the physics in a tick."""
        return round(self.tick / self.scenario.simulation.timestep)

    def edited(self, model: mujoco.MjModel) -> mujoco.MjModel:
        """A model as the run's `edit` leaves a copy of it; the same one without an edit."""
        if self.edit is None:
            return model
        out = copy(model)
        self.edit(out)
        return out

    @cached_property
    def profile(self) -> Profile:
        """The line of the ground's height."""
        return profile_of(self.scenario.ground, self.seed)

    @cached_property
    def torque_limits(self) -> tuple[float, ...]:
        """(nu,) [N m] limits of the actuators."""
        return torque_limits(self.robot, self.scenario)

    @property
    def tree(self) -> Tree:
        """Lengths and masses of seven links, as the model file says: what the controller believes in."""
        return seven_links(self.robot).tree

    @cached_property
    def true_tree(self) -> Tree:
        """Lengths and masses of the seven links that walk."""
        return true_tree(self.tree, self.scenario.truth)

    @cached_property
    def true_robot(self) -> Robot:
        """The robot that walks: with its true masses, and of seven links its true lengths too."""
        return true_robot(self.scenario.truth, self.robot)

    @property
    def believed_model(self) -> pinocchio.Model:
        """Pinocchio's model of seven links, which their law computes with; gravity as on the scenario's slope."""
        return believed_model(self.model, self.scenario.ground.slope)

    @property
    def home_tree(self) -> Tree:
        """Lengths and masses of the seven links that walk, as Pinocchio reads them: those of the home engine."""
        read = pinocchio_tree(self.believed_model, seven_links(self.robot))
        return true_tree(read, self.scenario.truth)

    def planar_model(self, visuals: bool = False) -> Foreign:
        """MuJoCo's model of seven links; runs that differ in nothing of it share one, which is not to be written to."""
        out = compile_foreign(self.model, self.scenario, visuals)
        return out if self.edit is None else out._replace(model=self.edited(out.model), spare=[])

    @cached_property
    def known_scenario(self) -> Scenario:
        """The scenario as the law knows it: the robot is the file's, and nothing lies ahead on its way."""
        return structs.replace(self.scenario, truth=Truth(), ground=levelled(self.scenario.ground))

    def stepped_model(
        self, command: Command, servos: tuple[Servo | None, ...] | None = None, known: bool = False
    ) -> mujoco.MjModel:
        """MuJoCo's model of a robot of any kind, shared likewise.

        Args:
            command: What its law commands.
            servos: Of the law; see `biped.robot.build.compiled`.
            known: Whether it is the one that the law knows.
        """
        from biped.robot.build import compiled  # of which seven links need nothing

        if known:
            return compiled(self.model, self.known_scenario, command, servos)
        return self.edited(compiled(self.model, self.scenario, command, servos))

    @property
    def visual_model(self) -> mujoco.MjModel:
        """The model that the run is drawn with."""
        return visual_model(self.model, self.scenario)


def visual_model(path: Path, scenario: Scenario) -> mujoco.MjModel:
    """A scenario's model with all that is only looked at; not to be written to."""
    if scenario.robot is not None:
        from biped.robot.build import compiled

        # Heights along the way are drawn by themselves.
        return compiled(path, structs.replace(scenario, ground=levelled(scenario.ground)), "torque")
    return compile_foreign(path, scenario, visuals=True).model
