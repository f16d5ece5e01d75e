"""A scenario becomes concrete runs: files found, every random draw resolved, each checked and replayable alone."""

import math
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import msgspec
import mujoco
import numpy as np

from biped.base.errors import InputError, echo, safe
from biped.base.files import locate, nearest
from biped.robot.ground import GRAVITY, begin_beyond, first_of, profile_of
from biped.robot.load import RobotStarts, check_gait, check_keys, force_on, load_robot, starts_of, walks_by_gait
from biped.robot.planar.model import check_home
from biped.robot.planar.topology import N_ROWS, NQ
from biped.robot.robot import Robot
from biped.robot.run import Factory, Run, visual_model
from biped.scenario.gains import Gains
from biped.scenario.gait import Gaits, Settings, read_reading, read_settings, resettled, settings_on
from biped.scenario.keys import Scenario
from biped.scenario.laws import THESIS
from biped.scenario.randomise import Normals
from biped.scenario.robot import Described
from biped.scenario.transitions import TRANSITIONS, Transitions, timed, transitions_of
from biped.scenario.valid import UNKNOWN, Origin
from biped.scenario.vary import DRAW, SWEEP, disturbed, drawn, points_of, run_seed, stream, with_values
from biped.scenario.world import BodyTruth, Disturbance, Push


class _Loaded(NamedTuple):
    """A robot with its model file and its starts."""

    path: Path
    robot: Robot
    starts: RobotStarts


class Runs:
    """Makes the runs of scenarios; files are read once."""

    def __init__(self):
        self._loaded: dict[tuple[str, Described | None], _Loaded] = {}
        self._gaits = Gaits()
        self._transitions: dict[str, Transitions] = {"": Transitions()}
        self._settings: dict[tuple[str, str, str | None], Settings] = {}

    def model(self, s: Scenario) -> Path:
        """The model file."""
        return self._load(s).path

    def robot(self, s: Scenario) -> Robot:
        """The robot in it."""
        return self._load(s).robot

    def gains(self, s: Scenario, at: str = "") -> Gains:
        """Gains of a scenario's gait, its own laid over them; its own where it names no gait and needs none.

        Args:
            s: The scenario.
            at: What the gait's key begins with: `change[0].` of one that a change goes over to.

        Raises:
            InputError: One is missing or of the wrong type, or they are of a walker in the plane instead of in space.
        """
        if not s.controller and not walks_by_gait(s):
            return s.gains
        gains = self._gaits[s.controller, s.gains]
        check_gait(s, self.robot(s), gains, at, complete=True)
        return gains

    def transitions(self, controller: str) -> Transitions:
        """The gaits by which a gait stops, stands and sets off; "": none.

        Raises:
            InputError: There is none of a name that its file gives.
        """
        if controller not in self._transitions:
            self._transitions[controller] = transitions_of(controller)
        return self._transitions[controller]

    def exchanged(self, s: Scenario, before: Scenario, varied: Iterable[str]) -> Scenario:
        """The scenario with the settings of its gait and its reading, where one is another than before."""
        if not walks_by_gait(s) or (s.controller, s.reading) == (before.controller, before.reading):
            return s
        old, new = (self._settings_of(s, one.controller, one.reading) for one in (before, s))
        return resettled(s, old, new, set(varied))

    def check(self, s: Scenario) -> None:
        """Makes sure that a run can be made.

        Raises:
            InputError: It cannot.
        """
        path, robot, starts = self._load(s)
        check_keys(s, robot)
        if s.engine == "home":
            check_home(path)
        self.gains(s)
        _pushes(s, robot)
        starts.start(s, None)
        _begins_beyond(s, starts)

    def run(
        self, s: Scenario, index: int, seed: int, values: dict[str, Any], origin: Origin, law: Factory | None
    ) -> Run:
        """A run, concrete; arguments as in `biped.robot.run.Run`."""
        path, robot, starts = self._load(s)
        q, v = starts.start(s, stream(seed, "start.jitter") if s.start.jitter > 0.0 else None)
        return Run(
            scenario=disturbed(_pushes(_weighed(s, robot, seed), robot), seed),
            model=path,
            robot=robot,
            gains=self.gains(s),
            index=index,
            seed=seed,
            values=values,
            q=q,
            v=v,
            mass_factor=_factors(s, seed, "controller_mass_matrix", (NQ, NQ)),
            row_factor=_factors(s, seed, "controller_constraints", (N_ROWS, NQ)),
            origin=origin,
            law=law,
        )

    def _settings_of(self, s: Scenario, controller: str, reading: str | None) -> Settings:
        key = s.model, controller, reading
        if key not in self._settings:
            gait, _ = read_settings(_file("controller", controller))
            below = {} if reading is None else read_reading(_file("reading", reading))[0]
            self._settings[key] = settings_on(self.model(s), gait, below)
        return self._settings[key]

    def _load(self, s: Scenario) -> _Loaded:
        key = s.model, s.robot
        if key not in self._loaded:
            path = locate("models", s.model, "model")
            robot = load_robot(path, s.robot)
            self._loaded[key] = _Loaded(path, robot, starts_of(path, robot, s.robot))
        return self._loaded[key]


def _file(key: str, name: str) -> Path:
    """The file that a key names; whoever knows where the key was written can say so of the error.

    Raises:
        InputError: There is none.
    """
    try:
        return locate(f"{key}s", name, key)
    except InputError as error:
        raise InputError(str(error), key) from error


def _pushes(s: Scenario, robot: Robot) -> Scenario:
    """The scenario with pushes and a random force on bodies of its robot; the trunk is the torso, whatever its name.

    Raises:
        InputError: A force is on another body, or has another dimension.
    """
    if s.push:
        pushes = tuple(_on_body(s, robot, push, f"push[{i}]") for i, push in enumerate(s.push))
        s = msgspec.structs.replace(s, push=pushes)
    if s.disturbance is None:
        return s
    return msgspec.structs.replace(s, disturbance=_on_body(s, robot, s.disturbance, "disturbance"))


_Acting = TypeVar("_Acting", Push, Disturbance)


def _on_body(s: Scenario, robot: Robot, acting: _Acting, at: str) -> _Acting:
    """A push or a random force on a body of the robot.

    Raises:
        InputError: It is on another body, or has another dimension.
    """
    trunk = robot.bodies[robot.trunk_number - 1]
    body = trunk if acting.body == "torso" and acting.body not in robot.bodies else acting.body
    if body not in robot.bodies:
        hint = nearest(body, list(robot.bodies))
        raise InputError(f"{at}.body: model '{s.model}' has no body '{safe(body)}'; {hint}", f"{at}.body")
    force = force_on(robot, acting.force, f"{at}.force", s.model)
    if isinstance(acting, Push) and acting.of == "weight":
        force = tuple(robot.mass * GRAVITY * one for one in force)
        acting = msgspec.structs.replace(acting, force=force, of="si")
    elif force != acting.force:
        acting = msgspec.structs.replace(acting, force=force)
    return acting if body == acting.body else msgspec.structs.replace(acting, body=body)


def _weighed(s: Scenario, robot: Robot, seed: int) -> Scenario:
    """The scenario with true masses that are drawn for this run."""
    most = s.randomise.masses
    if most == 0.0:
        return s
    replace = msgspec.structs.replace
    factors = stream(seed, "masses").uniform(1.0 - most, 1.0 + most, len(robot.bodies)).tolist()
    said = {one.name: one for one in s.truth.part}
    parts = (said.get(name, BodyTruth(name=name)) for name in robot.bodies)
    drawn = tuple(replace(one, mass=factor * one.mass) for one, factor in zip(parts, factors, strict=True))
    truth = replace(s.truth, part=drawn)
    return replace(s, truth=truth, randomise=replace(s.randomise, masses=0.0))


def _begins_beyond(s: Scenario, starts: RobotStarts) -> None:
    """Makes sure that the robot starts on the level, which the first tile or step lies beyond.

    Raises:
        InputError: It does not, or the law senses level ground.
    """
    profile = profile_of(s.ground, 0)
    if profile.level:
        return
    if s.law == THESIS:
        which = first_of(s.ground)
        raise InputError(f"ground.{which}: expected none: the law 'thesis' walks on level ground and slopes",
                         f"ground.{which}")  # fmt: skip
    begin_beyond(s.ground, profile, starts.foremost(s))


def _factors(s: Scenario, seed: int, name: str, shape: tuple[int, int]) -> np.ndarray | None:
    """The factors of a run's M or A; None where they are right, or drawn at every tick."""
    deviation = getattr(s.randomise, name)
    if deviation == 0.0 or s.randomise.controller_errors == "tick":
        return None
    return 1.0 + deviation * stream(seed, name).standard_normal(shape)


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
        """A run of the ensemble that has a seed of its own, such as `biped.scenario.randomise.Normals`."""
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
            if change.to == "first" and i == 0:
                raise InputError(f"{at}to: expected a change before it: the run still has its first gait", "change")
            if change.to is not None and change.controller is not None:
                raise InputError(f'{at}controller: expected none with to = "{change.to}"', "change")
            named = change.controller
            before = s.change[i - 1]
            if change.to in TRANSITIONS or (change.to == "first" and before.to == "start"):
                change = timed(change, before, self._runs.transitions(s.controller))  # noqa: PLW2901
            if change.to in TRANSITIONS:
                named = getattr(self._runs.transitions(s.controller), change.to)
                if named is None:
                    what = f'expected {change.to} = "…" in [transitions] of its file, or a controller instead'
                    raise InputError(f"{at}to: gait '{s.controller}' names no gait for it: {what}", "change")
            if named is not None or change.gains.speed is not None:
                controller = named or controller
                asked = msgspec.structs.replace(s, controller=controller, gains=change.gains)
                change = msgspec.structs.replace(change, gains=self._runs.gains(asked, at))  # noqa: PLW2901
            else:
                check_gait(s, self._runs.robot(s), change.gains, at, complete=False)
            changes.append(change)
        return msgspec.structs.replace(s, change=tuple(changes))
