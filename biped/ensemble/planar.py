"""Runs of planar bipeds of seven links, concrete: what a plan asks for unless the robot is of another kind."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from biped.base.errors import InputError
from biped.base.files import locate, nearest
from biped.base.text import said
from biped.robot.ground import begin_beyond, profile_of
from biped.robot.law_factory import Factory
from biped.robot.load import load_robot
from biped.robot.planar.model import bodies_of, posture_of
from biped.robot.planar.posture import project
from biped.robot.planar.topology import N_ANGLES, N_ROWS, NQ, PITCH
from biped.robot.planar.tree import ABSOLUTE_FROM_JOINT, Tree, absolute, from_absolute, motion
from biped.robot.planar.truth import true_tree
from biped.robot.robot import Robot, seven_links
from biped.robot.run import Run
from biped.scenario.gains import Gains
from biped.scenario.gait import Gaits, in_the_plane, read_settings
from biped.scenario.keys import Scenario, Start, Truth
from biped.scenario.origin import Origin
from biped.scenario.push import PLANE
from biped.scenario.settings import Settings, read_reading, resettled, settings_on
from biped.scenario.vary import stream

STARTS = 256
"""Most start postures kept at a time."""
LEAST_INERTIA = 1e-12
"""[kg, kg m²] A link with less cannot be simulated: MuJoCo refuses 1e-15."""


class PlanarRuns:
    """Makes the runs of scenarios whose robot is a planar biped of seven links; files are read once."""

    def __init__(self):
        self._models: dict[str, tuple[Path, Robot]] = {}
        self._gaits = Gaits()
        self._settings: dict[tuple[str, str, str | None], Settings] = {}
        self._starts: dict[tuple[str, Start, tuple[float, ...]], np.ndarray] = {}

    def model(self, s: Scenario) -> Path:
        """The model file."""
        return self._model(s.model)[0]

    def robot(self, s: Scenario) -> Robot:
        """The robot in it."""
        return self._model(s.model)[1]

    def gains(self, s: Scenario, at: str = "") -> Gains:
        """Gains of a scenario's gait, its own laid over them.

        Args:
            s: The scenario.
            at: What the gait's key begins with: `change[0].` of one that a change goes over to.

        Raises:
            InputError: One is missing or of the wrong type, or they are of a walker in space.
        """
        gains = self._gaits[s.controller, s.gains]
        in_the_plane(gains, s.model, at)
        return gains

    def suit(self, s: Scenario, gains: Gains, at: str) -> None:
        """Makes sure that some gains, whose key begins with `at`, are of a walker in the plane.

        Raises:
            InputError: They are of one in space.
        """
        in_the_plane(gains, s.model, at)

    def exchanged(self, s: Scenario, before: Scenario, varied: Iterable[str]) -> Scenario:
        """The scenario with the settings of its gait and its reading, where one is another than before."""
        if (s.controller, s.reading) == (before.controller, before.reading):
            return s
        old, new = (self._made_for(s.model, one.controller, one.reading) for one in (before, s))
        return resettled(s, old, new, set(varied))

    def check(self, s: Scenario) -> None:
        """Makes sure that a run can be made.

        Raises:
            InputError: It cannot.
        """
        self.gains(s)
        self._pushable(s)
        self._driven(s)
        self._solid(s)
        self._standing(s)

    def run(
        self, s: Scenario, index: int, seed: int, values: dict[str, Any], origin: Origin, law: Factory | None
    ) -> Run:
        """A run, concrete; arguments as in `biped.robot.run.Run`."""
        random, s = s.randomise, self._pushable(s)
        return Run(
            scenario=s,
            model=self.model(s),
            robot=self.robot(s),
            gains=self.gains(s),
            index=index,
            seed=seed,
            values=values,
            q=self._start(s, seed),
            v=np.linalg.solve(ABSOLUTE_FROM_JOINT, np.array(s.start.v)),
            mass_factor=_factors(random.controller_mass_matrix, seed, "controller_mass_matrix", (NQ, NQ)),
            row_factor=_factors(random.controller_constraints, seed, "controller_constraints", (N_ROWS, NQ)),
            origin=origin,
            law=law,
        )

    def _made_for(self, model: str, controller: str, reading: str | None) -> Settings:
        key = model, controller, reading
        if key not in self._settings:
            gait, _ = read_settings(_file("controller", controller))
            below = {} if reading is None else read_reading(_file("reading", reading))[0]
            self._settings[key] = settings_on(self._model(model)[0], gait, below)
        return self._settings[key]

    def _model(self, name: str) -> tuple[Path, Robot]:
        if name not in self._models:
            path = locate("models", name, "model")
            self._models[name] = path, load_robot(path, None)
        return self._models[name]

    def _pushable(self, s: Scenario) -> Scenario:
        """The scenario with pushes on bodies of its robot; the torso is one whatever it is called."""
        if not s.push:
            return s
        path = self.model(s)
        torso, pushes = self.robot(s).base, []
        for i, push in enumerate(s.push):
            if len(push.force) != PLANE:
                raise InputError(
                    f"push[{i}].force: expected [forward, up] N: model '{s.model}' moves in the plane; got "
                    f"{list(push.force)}", f"push[{i}].force",
                )  # fmt: skip
            if push.body in ("torso", torso):
                pushes.append(push if push.body == torso else msgspec.structs.replace(push, body=torso))
                continue
            bodies = bodies_of(path)
            if push.body not in bodies:
                raise InputError(
                    f"push[{i}].body: model '{s.model}' has no body '{said(push.body)}'; {nearest(push.body, bodies)}",
                    f"push[{i}].body",
                )
            pushes.append(push)
        return msgspec.structs.replace(s, push=tuple(pushes))

    def _driven(self, s: Scenario) -> None:
        if s.actuation.motors and self.robot(s).motor is None:
            raise InputError(
                f"actuation.motors: model '{s.model}' has none; expected a table [motor] in its description",
                "actuation.motors",
            )

    def _solid(self, s: Scenario) -> None:
        if s.truth == Truth():
            return
        true, links = self._true_tree(s), self.robot(s).bodies
        for link, mass, inertia in zip(links, true.mass, true.inertia, strict=True):
            if min(mass, inertia) < LEAST_INERTIA:
                raise InputError(
                    f"truth: {link}: expected a mass and a moment of inertia of at least {LEAST_INERTIA:g}, got "
                    f"{mass:.3g} kg and {inertia:.3g} kg m²",
                    "truth",
                )

    def _standing(self, s: Scenario) -> None:
        """Makes sure that there is a start, and that the first tile or step begins beyond its feet.

        Raises:
            InputError: There is none, or it does not.
        """
        q, profile = self._settled(s), profile_of(s.ground, 0)
        if profile.level:
            return
        foremost = float(motion(self._true_tree(s), q, np.zeros(NQ)).point[..., 0].max())
        begin_beyond(s.ground, profile, foremost)

    def _start(self, s: Scenario, seed: int) -> np.ndarray:
        q, start = self._settled(s), s.start
        if start.jitter > 0.0:
            q = absolute(q)
            q[PITCH:] += start.jitter * stream(seed, "start.jitter").standard_normal(N_ANGLES)
            q = from_absolute(q)
            if start.settle:
                q = project(self._true_tree(s), q, (), self.robot(s).points)
        return q

    def _true_tree(self, s: Scenario) -> Tree:
        tree = seven_links(self.robot(s)).tree
        return tree if s.truth == Truth() else true_tree(tree, s.truth)

    def _settled(self, s: Scenario) -> np.ndarray:
        start, points = s.start, self.robot(s).points
        if start.upright:
            raise InputError(f"start.upright: expected false: model '{s.model}' moves in the plane", "start.upright")
        key = s.model, start, s.truth.length
        if key not in self._starts:
            if start.q is not None:
                q, contacts = from_absolute(np.array(start.q)), ()
            else:
                q, contacts = posture_of(self.model(s), start.posture)
            contacts = contacts if start.contacts is None else start.contacts
            for name in contacts:
                if name not in points:
                    raise InputError(
                        f"start.contacts: '{said(name)}' is no contact point; {nearest(name, list(points))}",
                        "start.contacts",
                    )
            if len(self._starts) >= STARTS:
                self._starts.clear()
            self._starts[key] = project(self._true_tree(s), q, contacts, points) if start.settle else q
        return self._starts[key]


def _file(key: str, name: str) -> Path:
    """The file that a key names; whoever knows where the key was written can say so of the error.

    Raises:
        InputError: There is none.
    """
    try:
        return locate(f"{key}s", name, key)
    except InputError as error:
        raise InputError(str(error), key) from error


def _factors(deviation: float, seed: int, name: str, shape: tuple[int, int]) -> np.ndarray | None:
    if deviation == 0.0:
        return None
    return 1.0 + deviation * stream(seed, name).standard_normal(shape)
