"""Runs of robots of any kind, concrete: what a plan asks for where the robot is no planar biped of seven links."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec

from biped.base.errors import InputError
from biped.base.files import locate, nearest
from biped.base.text import said
from biped.robot.ground import begin_beyond, first_of, profile_of
from biped.robot.law_factory import Factory
from biped.robot.limits import torque_limits
from biped.robot.posture import Standing
from biped.robot.robot import Robot
from biped.robot.run import Run
from biped.robot.truth import check_truth
from biped.scenario.gains import Gains
from biped.scenario.gait import Gaits, out_of_the_plane
from biped.scenario.keys import Scenario
from biped.scenario.laws import BUILT_IN, SPATIAL
from biped.scenario.noticed import taken
from biped.scenario.origin import Origin
from biped.scenario.push import PLANE, SPACE
from biped.scenario.valid import fault
from biped.scenario.vary import stream


class GeneralRuns:
    """Makes the runs of scenarios whose robot is of any kind; files are read once."""

    def __init__(self):
        self._standing: dict[tuple[str, Any], Standing] = {}
        self._gaits = Gaits()

    def model(self, s: Scenario) -> Path:
        """The model file."""
        return locate("models", s.model, "model")

    def robot(self, s: Scenario) -> Robot:
        """The robot in it."""
        return self._at(s).robot

    def gains(self, s: Scenario, at: str = "") -> Gains:
        """Gains of a scenario's gait, its own laid over them; its own where it names no gait.

        Args:
            s: The scenario.
            at: What the gait's key begins with: `change[0].` of one that a change goes over to.

        Raises:
            InputError: One is missing or of the wrong type, or they are of a walker in the plane.
        """
        if not s.controller:
            return s.gains
        gains = self._gaits[s.controller, s.gains]
        if s.law == SPATIAL:
            out_of_the_plane(gains, s.model, at)
        return gains

    def suit(self, s: Scenario, gains: Gains, at: str) -> None:
        """Some of the gains are as good as all: those of any walker suit one in space."""

    def exchanged(self, s: Scenario, before: Scenario, varied: Iterable[str]) -> Scenario:
        """The scenario as it is: gaits of these robots have no settings."""
        return s

    def check(self, s: Scenario) -> None:
        """Makes sure that a run can be made.

        Raises:
            InputError: It cannot.
        """
        if s.law is None:
            raise InputError(
                "law: expected one: the thesis's law needs a planar biped of seven links; write law = 'path.py:Class', "
                f"or one of {', '.join(BUILT_IN)}", "law",
            )  # fmt: skip
        taken(s, fault)  # draws and points of a sweep say what no file did
        standing = self._at(s)
        self._pushes(s, standing.robot)
        torque_limits(standing.robot, s)
        if standing.robot.planar and s.ground.side_slope != 0.0:
            raise InputError(
                f"ground.side_slope: expected 0: model '{s.model}' moves in the plane", "ground.side_slope"
            )
        check_truth(s.truth, standing.robot)
        standing.start(s.start, s.ground, None)
        self._beyond_the_feet(s, standing)

    def _beyond_the_feet(self, s: Scenario, standing: Standing) -> None:
        """Makes sure that the robot starts on the level, which the first tile or step lies beyond.

        Raises:
            InputError: It does not, or the law senses level ground.
        """
        profile = profile_of(s.ground, 0)
        if profile.level:
            return
        if s.law == SPATIAL:
            which = first_of(s.ground)
            raise InputError(f"ground.{which}: expected none: the law 'spatial' walks on level ground and slopes",
                             f"ground.{which}")  # fmt: skip
        begin_beyond(s.ground, profile, standing.foremost())

    def run(
        self, s: Scenario, index: int, seed: int, values: dict[str, Any], origin: Origin, law: Factory | None
    ) -> Run:
        """A run, concrete; arguments as in `biped.robot.run.Run`."""
        standing = self._at(s)
        noise = stream(seed, "start.jitter") if s.start.jitter > 0.0 else None
        q, v = standing.start(s.start, s.ground, noise)
        s = msgspec.structs.replace(s, push=self._pushes(s, standing.robot))
        return Run(s, self.model(s), standing.robot, self.gains(s), index, seed, values, q, v, None, None, origin, law)

    def _at(self, s: Scenario) -> Standing:
        key = s.model, s.robot
        if key not in self._standing:
            assert s.robot is not None
            self._standing[key] = Standing(self.model(s), s.robot)
        return self._standing[key]

    def _pushes(self, s: Scenario, robot: Robot) -> tuple[Any, ...]:
        """Pushes on bodies of the robot; its base is the torso, whatever it is called."""
        pushes = []
        size, words = (PLANE, "[forward, up]") if robot.planar else (SPACE, "[forward, left, up]")
        for i, push in enumerate(s.push):
            trunk = robot.bodies[robot.trunk_number - 1]
            body = trunk if push.body == "torso" and push.body not in robot.bodies else push.body
            if body not in robot.bodies:
                hint = nearest(body, list(robot.bodies))
                raise InputError(
                    f"push[{i}].body: model '{s.model}' has no body '{said(body)}'; {hint}", f"push[{i}].body"
                )
            if len(push.force) != size:
                where = "in the plane" if robot.planar else "in space"
                raise InputError(
                    f"push[{i}].force: expected {words} N: model '{s.model}' moves {where}; got {list(push.force)}",
                    f"push[{i}].force",
                )
            pushes.append(msgspec.structs.replace(push, body=body))
        return tuple(pushes)
