"""A scenario becomes concrete runs: each with its own seed and every random draw resolved, replayable alone."""

import math
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import mujoco

from biped.base.errors import InputError
from biped.base.text import echo, safe
from biped.ensemble.runs import Runs
from biped.robot.law_factory import Factory
from biped.robot.robot import Robot
from biped.robot.run import Run, visual_model
from biped.robot.suitable import check_gait
from biped.scenario.keys import Scenario
from biped.scenario.normals import Normals
from biped.scenario.origin import UNKNOWN, Origin
from biped.scenario.vary import DRAW, SWEEP, drawn, points_of, run_seed, with_values

CHECKED = 10_000
"""Most runs that are looked at before the first is made."""


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
        self._point: tuple[int, Scenario] | None = None
        self._runs = Runs()
        with origin.naming():
            # Gains are written out, so that they can be swept and a saved scenario does not depend on a gait file;
            # unless the gait file itself varies, or the speed of a family.
            varying = scenario.sweep.keys() | scenario.randomise.draw.keys()
            if not any(key.endswith(("controller", "gains.speed")) for key in varying):
                scenario = self._with_changes(msgspec.structs.replace(scenario, gains=self._runs.gains(scenario)))
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
        return self._runs.model(self.scenario)

    @cached_property
    def robot(self) -> Robot:
        """The robot of the scenario itself."""
        return self._runs.robot(self.scenario)

    @property
    def visual_model(self) -> mujoco.MjModel:
        """The model that runs of the scenario itself are drawn with."""
        return visual_model(self.model, self.scenario)

    def run(self, index: int) -> Run:
        """Run `index` of the campaign: run index % runs of the ensemble at point index // runs."""
        with self.origin.naming():
            return self._run(index)

    def run_from(self, seed: int) -> Run:
        """A run of the ensemble that has a seed of its own, such as `biped.scenario.normals.Normals`."""
        with self.origin.naming():
            return self._run(0, seed)

    def _run(self, index: int, seed: int | None = None) -> Run:
        s, values, seed = self._drawn(index, seed)
        return self._runs.run(s, index, seed, values, self.origin, self.law)

    def _drawn(self, index: int, seed: int | None = None) -> tuple[Scenario, dict[str, object], int]:
        """The scenario of a run, what its point and its draws changed, and its seed."""
        point, number = divmod(index, self.scenario.randomise.runs)
        if seed is None:
            seed = run_seed(self.scenario.seed, number)
            seed = Normals(seed, moves) if (moves := self.scenario.randomise.moves) else seed
        swept = self.points[point]
        if self._point is None or self._point[0] != point:
            there = with_values(self.scenario, swept, SWEEP)
            self._point = point, self._runs.exchanged(there, self.scenario, swept.keys())
        at_point = self._point[1]
        draws = drawn(at_point, number, seed)
        s = with_values(at_point, draws, DRAW._replace(run=index))
        s = self._runs.exchanged(s, at_point, swept.keys() | draws.keys())
        return self._with_changes(s), swept | draws, seed

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
                    self._runs.check(s)
                except InputError as error:
                    if not values:
                        raise
                    shown = safe(", ".join(f"{safe(key)} = {echo(value)}" for key, value in values.items()))
                    asked = DRAW._replace(run=index) if self.scenario.randomise.draw else SWEEP
                    raise asked.fault(f": {shown}: {error}") from error

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
                change = msgspec.structs.replace(change, gains=self._runs.gains(asked, at))  # noqa: PLW2901
            else:
                check_gait(s, change.gains, at, complete=False)
            changes.append(change)
        return msgspec.structs.replace(s, change=tuple(changes))
