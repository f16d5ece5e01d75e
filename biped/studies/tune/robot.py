"""A search for a robot of which only the model file is known: `tune/any` on it, from the gait that comes furthest.

What it finds is put to tests on seeds that no search has seen, as any other gait of the robot would be.
"""

import math
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

from msgspec import to_builtins

from biped.base.errors import InputError
from biped.base.files import URDF, locate
from biped.ensemble import executor
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.campaign import run_one
from biped.ensemble.plan import Plan
from biped.robot.ground import GRAVITY
from biped.robot.report import look
from biped.scenario.reading import read_scenario
from biped.scenario.vary import setting
from biped.studies.run import run
from biped.studies.standard import StandardTable, standard

SCENARIO = "tune/any"
GAITS = ("any/sure", "any/quick", "any/short", "any/long")
"""Gaits of the human in units of any walker."""
POSTURES = ("heel_toe", "flat", "single")
ASSISTS = (1.0, 0.0)
"""Shares of Q_d itself in what acts; the search begins at the gait that stays up longest with none."""
_PACE = 0.3
"""[√(g l)] that a run which falls must have kept to earn all that its distance can earn: a brisk walk."""
_SECONDS = 6.0
"""Of a trial."""
TESTS = "any/cells/"
"""Tests that a gait is put to once it is found."""
_LEVEL = f"{TESTS}level"
_KEPT = "robot", "simulation", "fall", "truth", "sensors", "sensing"
"""Tables of changes that are no matter of a search: tests are made with them too."""


class Trial(NamedTuple):
    """One shipped gait on a robot.

    Attributes:
        gait: Its name.
        assist: Share of Q_d itself in what acts; the rest are joint torques.
        times: (3,) [s] until it fell, by posture.
        distances: (3,) [m] it came.
    """

    gait: str
    assist: float
    times: tuple[float, ...]
    distances: tuple[float, ...]

    @property
    def merit(self) -> float:
        """[s] until it fell, in the mean."""
        return sum(self.times) / len(self.times)


class RobotVerdict(NamedTuple):
    """Tests and a walk of a gait that was found for a robot.

    Attributes:
        table: Of its tests.
        tests: Their folder.
        walk: Folder of a walk on the level, to look at.
    """

    table: StandardTable
    tests: Path
    walk: Path


def is_model(name: str) -> bool:
    """Whether an argument of `biped tune` is a robot's model file, not a scenario."""
    return Path(name).suffix in (".xml", URDF)


def search_of(
    name: str, changes: Sequence[str], jobs: Jobs, progress: Progress = silent
) -> tuple[list[str], list[Trial]]:
    """The changes that make `tune/any` a search for a robot, and how far shipped gaits came on it.

    Args:
        name: Path of its model file.
        changes: `--set` changes, which come last.
        jobs: Number of processes, or a cluster.
        progress: Told of every run.

    Raises:
        InputError: The law is not for this robot: the part that is another.
    """
    report = look(name)
    if report.faults:
        raise InputError(f"{name}: {report.faults[0]}", "model")
    if report.not_spatial:
        raise InputError(report.not_spatial, "law")
    model = f'model="{locate("models", name, "model").resolve()}"'
    cases = list(product(ASSISTS, GAITS, POSTURES))
    with executor.workers(_Shipped((model, *changes)), jobs) as carried_out, progress(name, len(cases), 0) as advance:
        found = []
        for one in carried_out(cases):
            found.append(one)
            advance()
    trials = []
    for i in range(0, len(cases), len(POSTURES)):
        assist, gait, _ = cases[i]
        times, distances = zip(*found[i : i + len(POSTURES)], strict=True)
        trials.append(Trial(gait, assist, times, distances))
    begins = max((one for one in trials if not one.assist), key=lambda one: one.merit)
    pace = f"tune.pace={_PACE * math.sqrt(GRAVITY * report.leg):.3g}"
    return [model, f'controller="{begins.gait}"', pace, _stages(report.held), *changes], trials


def verdict(
    gait: Path, changes: Sequence[str], jobs: Jobs, progress: Progress = silent, tell: Told = unheard
) -> RobotVerdict:
    """Puts a gait that was found for a robot to the tests, and makes a walk to look at, all beside the gait.

    Args:
        gait: Its file, in the results folder of its search; what is there already of its tests is not made again.
        changes: Of the search; tests are made with those that say what the robot is.
        jobs: Number of processes, or a cluster.
        progress: Told of every finished run.
        tell: Told what of an interrupted campaign could not be used.
    """
    own = [one for one in changes if one.startswith("model=") or one.startswith(tuple(f"{key}." for key in _KEPT))]
    tests, walk = gait.parent / "tests", gait.parent / "walk"
    table = standard([str(gait)], [TESTS], own, jobs, tests, progress)
    alone = (f'controller="{gait}"', "randomise.runs=1", "randomise.draw={}")
    run(_LEVEL, [*own, *alone], jobs, walk, progress=progress, tell=tell)
    return RobotVerdict(table, tests, walk)


def _stages(joints: Sequence[str]) -> str:
    """The change that has arms, waist and head stiff where a stage asks for it."""
    tune = read_scenario(SCENARIO).tune
    stages = [] if tune is None else [{key: value for key, value in to_builtins(stage).items() if value}
                                      for stage in tune.stages]  # fmt: skip
    for stage in stages:
        if "robot" in stage.get("set", {}):
            stage["set"]["robot"] = {"rigid": list(joints)}
    return setting("tune.stages", stages)


class _Shipped:
    """Runs of shipped gaits on a robot.

    Args:
        changes: To `tune/any`.
    """

    def __init__(self, changes: tuple[str, ...]):
        self._changes = changes

    def __call__(self, case: tuple[float, str, str]) -> tuple[float, float]:
        """[s] until a run fell, and [m] it came."""
        assist, gait, posture = case
        fixed = (f'controller="{gait}"', f"actuation.assist={assist}", f"start.posture={posture}", "start.jitter=0.0",
                 f"duration={_SECONDS}", "randomise.draw={}")  # fmt: skip
        s = read_scenario(SCENARIO, [*fixed, *self._changes])
        row = run_one(Plan(s), 0)[1].as_dict()
        return row["time"], row["distance"]
