"""A scenario becomes concrete runs: each with its own seed and every random draw resolved, replayable alone."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np

from biped.base.errors import InputError
from biped.base.files import locate, nearest
from biped.robot.description import robot_at
from biped.robot.model import bodies_of, posture_of, tree_at, true_tree
from biped.robot.posture import project
from biped.robot.run import Run
from biped.robot.topology import N_ANGLES, N_ROWS, NQ, PITCH
from biped.robot.tree import ABSOLUTE_FROM_JOINT, Tree, absolute, from_absolute
from biped.scenario.gains import Gains
from biped.scenario.keys import Scenario, Start, Truth
from biped.scenario.reading import read_gains
from biped.scenario.vary import drawn, points_of, run_seed, stream, with_values


class Plan:
    """The runs of a scenario: every point of its sweep times every run of its ensemble.

    Runs of equal number at different points share their seed, so that points differ by what was swept alone. Files are
    read once; draws are made when a run is asked for.

    Args:
        scenario: A checked scenario.

    Attributes:
        scenario: The same, effective: its gains written out.
        points: The points of its sweep.

    Raises:
        InputError: Model, gait, start posture, sweep or draws cannot be used.
    """

    def __init__(self, scenario: Scenario):
        self._models: dict[str, tuple[Path, Tree]] = {}
        self._gaits: dict[tuple[str, Gains], Gains] = {}
        self._starts: dict[tuple[str, Start, bytes], np.ndarray] = {}
        # Gains are written out, so that they can be swept and a saved scenario does not depend on a gait file; unless
        # the gait file itself varies, or the speed of a family.
        varying = scenario.sweep.keys() | scenario.randomise.draw.keys()
        if not any(key.endswith(("controller", "gains.speed")) for key in varying):
            scenario = self._with_changes(msgspec.structs.replace(scenario, gains=self._gait(scenario)))
        self.scenario = scenario
        self.points = points_of(scenario)
        for point in range(len(self.points)):
            self.run(point * scenario.randomise.runs)

    def __len__(self) -> int:
        return len(self.points) * self.scenario.randomise.runs

    @cached_property
    def model(self) -> Path:
        """The model file of the scenario itself."""
        return self._model(self.scenario.model)[0]

    def run(self, index: int) -> Run:
        """Run `index` of the campaign: run index % runs of the ensemble at point index // runs."""
        point, number = divmod(index, self.scenario.randomise.runs)
        seed = run_seed(self.scenario.seed, number)
        at_point = with_values(self.scenario, self.points[point], "sweep")
        draws = drawn(at_point, number, seed)
        s = self._with_changes(with_values(at_point, draws, f"randomise.draw, run {index}"))
        random = s.randomise
        path, tree = self._model(s.model)
        s = self._pushable(s, path)
        return Run(
            scenario=s,
            model=path,
            gains=self._gait(s),
            index=index,
            seed=seed,
            values=self.points[point] | draws,
            q=self._start(s, path, tree if s.truth == Truth() else true_tree(tree, s.truth), seed),
            v=np.linalg.solve(ABSOLUTE_FROM_JOINT, np.array(s.start.v)),
            mass_factor=_factors(random.controller_mass_matrix, seed, "controller_mass_matrix", (NQ, NQ)),
            row_factor=_factors(random.controller_constraints, seed, "controller_constraints", (N_ROWS, NQ)),
        )

    def _model(self, name: str) -> tuple[Path, Tree]:
        if name not in self._models:
            path = locate("models", name, "model")
            self._models[name] = path, tree_at(path)
        return self._models[name]

    def _pushable(self, s: Scenario, path: Path) -> Scenario:
        """The scenario with pushes on bodies of its robot; the torso is one whatever it is called."""
        if not s.push:
            return s
        torso, pushes = robot_at(path).base.link, []
        for i, push in enumerate(s.push):
            if push.body in ("torso", torso):
                pushes.append(push if push.body == torso else msgspec.structs.replace(push, body=torso))
                continue
            bodies = bodies_of(path)
            if push.body not in bodies:
                raise InputError(
                    f"push[{i}].body: model '{s.model}' has no body '{push.body}'; {nearest(push.body, bodies)}",
                    f"push[{i}].body",
                )
            pushes.append(push)
        return msgspec.structs.replace(s, push=tuple(pushes))

    def _gait(self, s: Scenario) -> Gains:
        key = s.controller, s.gains
        if key not in self._gaits:
            self._gaits[key] = read_gains(locate("controllers", s.controller, "controller"), s.gains)
        return self._gaits[key]

    def _with_changes(self, s: Scenario) -> Scenario:
        """The scenario with the gains of changes that name a gait, or the speed of a family, written out."""
        if not s.change:
            return s
        changes, controller = [], s.controller
        for change in s.change:
            if change.controller is not None or change.gains.speed is not None:
                controller = change.controller or controller
                asked = msgspec.structs.replace(s, controller=controller, gains=change.gains)
                change = msgspec.structs.replace(change, gains=self._gait(asked))  # noqa: PLW2901
            changes.append(change)
        return msgspec.structs.replace(s, change=tuple(changes))

    def _start(self, s: Scenario, path: Path, tree: Tree, seed: int) -> np.ndarray:
        start = s.start
        q = self._settled(s.model, start, path, tree)
        if start.jitter > 0.0:
            q = absolute(q)
            q[PITCH:] += start.jitter * stream(seed, "start.jitter").standard_normal(N_ANGLES)
            q = from_absolute(q)
            if start.settle:
                q = project(tree, q, (), robot_at(path).points)
        return q

    def _settled(self, model: str, start: Start, path: Path, tree: Tree) -> np.ndarray:
        points = robot_at(path).points
        key = model, start, tree.joint.tobytes() + tree.point.tobytes()
        if key not in self._starts:
            if start.q is not None:
                q, contacts = from_absolute(np.array(start.q)), ()
            else:
                q, contacts = posture_of(path, start.posture)
            contacts = contacts if start.contacts is None else start.contacts
            for name in contacts:
                if name not in points:
                    raise InputError(
                        f"start.contacts: '{name}' is no contact point; {nearest(name, list(points))}", "start.contacts"
                    )
            self._starts[key] = project(tree, q, contacts, points) if start.settle else q
        return self._starts[key]


def _factors(deviation: float, seed: int, name: str, shape: tuple[int, int]) -> np.ndarray | None:
    if deviation == 0.0:
        return None
    return 1.0 + deviation * stream(seed, name).standard_normal(shape)
