"""A scenario becomes concrete runs: each with its own seed and every random draw resolved, replayable alone."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from biped.base.errors import InputError
from biped.base.files import locate, nearest
from biped.base.text import echo, said
from biped.robot.description import robot_at
from biped.robot.given import Factory
from biped.robot.ground import begin_beyond, profile_of
from biped.robot.model import bodies_of, posture_of, tree_at, true_tree
from biped.robot.posture import project
from biped.robot.run import Run
from biped.robot.topology import N_ANGLES, N_ROWS, NQ, PITCH
from biped.robot.tree import ABSOLUTE_FROM_JOINT, Tree, absolute, from_absolute, motion
from biped.scenario.gains import Gains
from biped.scenario.gait import Settings, in_the_plane, out_of_the_plane, read_gains, resettled, settings_on
from biped.scenario.keys import Scenario, Start, Truth
from biped.scenario.laws import SPATIAL
from biped.scenario.origin import UNKNOWN, Origin
from biped.scenario.vary import DRAW, SWEEP, drawn, points_of, run_seed, stream, with_values

if TYPE_CHECKING:
    from biped.ensemble.general import GeneralRuns

STARTS = 256
"""Most start postures kept at a time."""
CHECKED = 10_000
"""Most runs that are looked at before the first is made."""
PLANE = 2
"""Components of a push in the plane."""
LEAST_INERTIA = 1e-12
"""[kg, kg m²] A link with less cannot be simulated: MuJoCo refuses 1e-15."""


class Plan:
    """The runs of a scenario: every point of its sweep times every run of its ensemble.

    Runs of equal number at different points share their seed, so that points differ by what was swept alone. Files are
    read once; draws are made when a run is asked for. Before that all of them are checked: that no run of a campaign
    finds out late that it cannot be made costs about 0.1 ms each, 2 ms where a start must be found anew. Of a campaign
    of more than `CHECKED` runs, so many are, spread over its points.

    Args:
        scenario: A checked scenario.
        origin: Where its keys were written, so that errors name the file.
        checked: Whether all draws were checked before, so that only the first run at each point is.
        law: Makes the law of every run; default: what the scenario says.

    Attributes:
        scenario: The same, effective: its gains written out.
        origin: As given.
        points: The points of its sweep.

    Raises:
        InputError: Model, gait, start posture, sweep or draws cannot be used.
    """

    def __init__(self, scenario: Scenario, origin: Origin = UNKNOWN, checked: bool = False, law: Factory | None = None):
        self.origin, self.law = origin, law
        self._models: dict[str, tuple[Path, Tree]] = {}
        self._gaits: dict[tuple[str, Gains], Gains] = {}
        self._settings: dict[tuple[str, str], Settings] = {}
        self._starts: dict[tuple[str, Start, tuple[float, ...]], np.ndarray] = {}
        self._point: tuple[int, Scenario] | None = None
        self._general: GeneralRuns | None = None
        if scenario.robot is not None:
            from biped.ensemble.general import GeneralRuns

            self._general = GeneralRuns()
        with origin.naming():
            # Gains are written out, so that they can be swept and a saved scenario does not depend on a gait file;
            # unless the gait file itself varies, or the speed of a family.
            varying = scenario.sweep.keys() | scenario.randomise.draw.keys()
            if not any(key.endswith(("controller", "gains.speed")) for key in varying):
                scenario = self._with_changes(msgspec.structs.replace(scenario, gains=self._gait(scenario)))
            self.scenario = scenario
            self.points = points_of(scenario)
            self._check(1 if checked else self._different())

    def __reduce__(self) -> tuple[Any, ...]:
        return Plan, (self.scenario, self.origin, True, self.law)  # made anew wherever it is sent

    def __len__(self) -> int:
        return len(self.points) * self.scenario.randomise.runs

    @cached_property
    def model(self) -> Path:
        """The model file of the scenario itself."""
        if self._general is not None:
            return self._general.model(self.scenario)
        return self._model(self.scenario.model)[0]

    def run(self, index: int) -> Run:
        """Run `index` of the campaign: run index % runs of the ensemble at point index // runs."""
        with self.origin.naming():
            return self._run(index)

    def _run(self, index: int) -> Run:
        s, values, seed = self._drawn(index)
        random = s.randomise
        if self._general is not None:
            return self._general.run(s, index, seed, values, self.origin, self.law)
        path, _ = self._model(s.model)
        s = self._pushable(s, path)
        return Run(
            scenario=s,
            model=path,
            gains=self._gait(s),
            index=index,
            seed=seed,
            values=values,
            q=self._start(s, seed),
            v=np.linalg.solve(ABSOLUTE_FROM_JOINT, np.array(s.start.v)),
            mass_factor=_factors(random.controller_mass_matrix, seed, "controller_mass_matrix", (NQ, NQ)),
            row_factor=_factors(random.controller_constraints, seed, "controller_constraints", (N_ROWS, NQ)),
            origin=self.origin,
            law=self.law,
        )

    def _drawn(self, index: int) -> tuple[Scenario, dict[str, object], int]:
        """The scenario of a run, what its point and its draws changed, and its seed."""
        point, number = divmod(index, self.scenario.randomise.runs)
        seed = run_seed(self.scenario.seed, number)
        swept = self.points[point]
        if self._point is None or self._point[0] != point:
            self._point = point, self._exchanged(with_values(self.scenario, swept, SWEEP), self.scenario, swept.keys())
        at_point = self._point[1]
        draws = drawn(at_point, number, seed)
        s = with_values(at_point, draws, DRAW._replace(run=index))
        s = self._exchanged(s, at_point, swept.keys() | draws.keys())
        return self._with_changes(s), swept | draws, seed

    def _exchanged(self, s: Scenario, before: Scenario, varied: Iterable[str]) -> Scenario:
        """The scenario with the settings of its gait, where that is another than before."""
        if s.controller == before.controller or self._general is not None:
            return s
        old, new = (self._made_for(s.model, controller) for controller in (before.controller, s.controller))
        return resettled(s, old, new, set(varied))

    def _made_for(self, model: str, controller: str) -> Settings:
        if (model, controller) not in self._settings:
            gait = locate("controllers", controller, "controller")
            self._settings[model, controller] = settings_on(self._model(model)[0], gait)
        return self._settings[model, controller]

    def _different(self) -> int:
        """How many runs of each point may differ in more than their random numbers."""
        random = self.scenario.randomise
        if any(draw.grid is None for draw in random.draw.values()):
            return random.runs
        return min(random.runs, math.lcm(*(len(draw.grid or ()) for draw in random.draw.values())))

    def _check(self, runs: int) -> None:
        """Makes sure that the first `runs` runs at every point can be made.

        Raises:
            InputError: One cannot.
        """
        points = len(self.points)
        looked_at = min(points, CHECKED)
        for place in range(looked_at):
            point = place * points // looked_at
            for number in range(min(runs, max(1, CHECKED // looked_at))):
                index = point * self.scenario.randomise.runs + number
                s, values, _ = self._drawn(index)
                try:
                    if self._general is not None:
                        self._general.check(s)
                        continue
                    self._gait(s)
                    self._pushable(s, self._model(s.model)[0])
                    self._driven(s)
                    self._solid(s)
                    self._standing(s, self._settled(s))
                except InputError as error:
                    if not values:
                        raise
                    shown = said(", ".join(f"{said(key)} = {echo(value)}" for key, value in values.items()))
                    asked = DRAW._replace(run=index) if self.scenario.randomise.draw else SWEEP
                    raise asked.fault(f": {shown}: {error}") from error

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

    def _gait(self, s: Scenario, at: str = "") -> Gains:
        """The scenario's gait, of a key that begins with `at`."""
        if self._general is not None and not s.controller:
            return s.gains
        key = s.controller, s.gains
        if key not in self._gaits:
            self._gaits[key] = read_gains(locate("controllers", s.controller, "controller"), s.gains)
        self._of_this_robot(s, self._gaits[key], at)
        return self._gaits[key]

    def _of_this_robot(self, s: Scenario, gains: Gains, at: str) -> None:
        """Makes sure that gains are of a biped that moves in the plane, or in space, as this one does."""
        if self._general is None:
            in_the_plane(gains, s.model, at)
        elif s.law == SPATIAL:
            out_of_the_plane(gains, s.model, at)

    def _with_changes(self, s: Scenario) -> Scenario:
        """The scenario with the gains of changes that name a gait, or the speed of a family, written out."""
        if not s.change:
            return s
        changes, controller = [], s.controller
        for i, change in enumerate(s.change):
            at = f"change[{i}]."
            if change.controller is not None or change.gains.speed is not None:
                controller = change.controller or controller
                asked = msgspec.structs.replace(s, controller=controller, gains=change.gains)
                change = msgspec.structs.replace(change, gains=self._gait(asked, at))  # noqa: PLW2901
            elif self._general is None:
                in_the_plane(change.gains, s.model, at)
            changes.append(change)
        return msgspec.structs.replace(s, change=tuple(changes))

    def _driven(self, s: Scenario) -> None:
        if s.actuation.motors and robot_at(self._model(s.model)[0]).motor is None:
            raise InputError(
                f"actuation.motors: model '{s.model}' has none; expected a table [motor] in its description",
                "actuation.motors",
            )

    def _solid(self, s: Scenario) -> None:
        if s.truth == Truth():
            return
        tree, truth = self._model(s.model)[1], s.truth
        true, links = true_tree(tree, truth), robot_at(self._model(s.model)[0]).links
        for link, mass, inertia in zip(links, true.mass, true.inertia, strict=True):
            if min(mass, inertia) < LEAST_INERTIA:
                raise InputError(
                    f"truth: {link}: expected a mass and a moment of inertia of at least {LEAST_INERTIA:g}, got "
                    f"{mass:.3g} kg and {inertia:.3g} kg m²",
                    "truth",
                )

    def _standing(self, s: Scenario, q: np.ndarray) -> None:
        """Makes sure that the first tile or step begins beyond the feet.

        Raises:
            InputError: It does not.
        """
        profile = profile_of(s.ground, 0)
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
                q = project(self._true_tree(s), q, (), robot_at(self._model(s.model)[0]).points)
        return q

    def _true_tree(self, s: Scenario) -> Tree:
        tree = self._model(s.model)[1]
        return tree if s.truth == Truth() else true_tree(tree, s.truth)

    def _settled(self, s: Scenario) -> np.ndarray:
        start, points = s.start, robot_at(self._model(s.model)[0]).points
        if start.upright:
            raise InputError(f"start.upright: expected false: model '{s.model}' moves in the plane", "start.upright")
        key = s.model, start, s.truth.length
        if key not in self._starts:
            if start.q is not None:
                q, contacts = from_absolute(np.array(start.q)), ()
            else:
                q, contacts = posture_of(self._model(s.model)[0], start.posture)
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


def _factors(deviation: float, seed: int, name: str, shape: tuple[int, int]) -> np.ndarray | None:
    if deviation == 0.0:
        return None
    return 1.0 + deviation * stream(seed, name).standard_normal(shape)
