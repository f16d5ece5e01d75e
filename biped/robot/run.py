"""One run, concrete: everything random in it is drawn, and everything it needs is in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from biped.robot.ground import Profile, profile_of
from biped.robot.law_factory import Factory
from biped.robot.planar.tree import Tree
from biped.robot.planar.truth import true_tree
from biped.robot.robot import Robot, seven_links, torque_limits
from biped.robot.truth import true_robot
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario
from biped.scenario.origin import UNKNOWN, Origin


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
        mass_factor: (9, 9) elementwise factors of the controller's M, or None.
        row_factor: (10, 9) elementwise factors of the controller's A, or None.
        origin: Where the keys of its scenario were written.
        law: Makes the run's own law where one was handed over as an object (`biped.robot.law_factory`).
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
