"""A search for a robot of which only the model file is known: `tune/any` on it, from the gait that comes furthest.

What it finds is put to tests on seeds that no search has seen, as any other gait of the robot would be.
"""

import math
from collections.abc import Sequence
from hashlib import blake2b
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from msgspec import to_builtins
from msgspec.structs import replace

from biped.base.errors import InputError, safe
from biped.base.files import URDF, label, locate, nearest
from biped.base.writing import write_text
from biped.ensemble import executor
from biped.ensemble.backend import Jobs, Progress, Told, silent, unheard
from biped.ensemble.campaign import measured
from biped.ensemble.journal import installed
from biped.ensemble.plan import Plan
from biped.robot.ground import GRAVITY
from biped.robot.report import look
from biped.scenario.engines import ENGINES
from biped.scenario.goals import Tune
from biped.scenario.reading import read, read_scenario
from biped.scenario.valid import COMMAND_LINE
from biped.scenario.vary import setting
from biped.studies.run import run
from biped.studies.standard import StandardTable, standard
from biped.studies.tune import tune
from biped.studies.tune.evaluate import earned

SCENARIO = "tune/any"
_NAMES = "sure", "quick", "short", "long", "steady", "g1", "h1", "apollo", "berkeley", "t1", "xbot"
GAITS = tuple(f"any/{name}" for name in _NAMES)
"""Gaits in units of any walker: five of the human, and those that were found for other robots."""
POSTURES = ("heel_toe", "flat", "single")
ASSISTS = (1.0, 0.0)
"""Shares of Q_d itself in what acts; the search begins at gaits that come furthest with none."""
PLACES = 6
"""Most gaits, each with its best posture, from which the search is tried before it goes on from one."""
_PACE = 0.3
"""[√(g l)] that a run which falls must have kept to earn all that its distance can earn: a brisk walk."""
_SECONDS = 6.0
"""Of a trial."""
TESTS = "any/cells/"
"""Tests that a gait is put to once it is found."""
_LEVEL = f"{TESTS}level"
SEARCHES = {"stop": "tune/any_stop", "start": "tune/any_start"}
"""Searches for the gaits by which a walk stops and sets off."""
_KEYS = {
    "stop": {"change.0.after_landing": "stop_after_landing"},
    "start": {"change.1.over": "start_over", "change.2.over": "walk_over"},
}
"""Their keys, and what they are called beside the walk's gait."""
_STANDS = 0.8
"""Share of stops, and of pushes after them, from which on the gait that stops a walk is that of its stand too."""
_SIDEWAYS = {"half": "push.0.force.1", "pushed": "push.0.force.1", "slope": "ground.side_slope"}
"""Draws that push or tilt a robot to the side, by their condition."""
_IN_PLANE = tuple(
    f'tune.conditions.{name}.set.randomise.draw."{key}"={value}'
    for name, key in _SIDEWAYS.items()
    for value in ("{}", "{grid=[0.0]}")
)
"""Changes that leave them out of the search."""
_KEPT = "robot", "simulation", "fall", "truth", "sensors", "sensing"
"""Tables of changes that are no matter of a search: tests are made with them too."""


class Trial(NamedTuple):
    """One shipped gait on a robot.

    Attributes:
        gait: Its name.
        assist: Share of Q_d itself in what acts; the rest are joint torques.
        times: (n,) [s] until it fell, by posture.
        distances: (n,) [m] it came; nan where its numbers blew up.
        earned: (n,) what each run has earned towards a walk, of 1, by the measure of the search.
    """

    gait: str
    assist: float
    times: tuple[float, ...]
    distances: tuple[float, ...]
    earned: tuple[float, ...]


class RobotVerdict(NamedTuple):
    """Tests and a walk of a gait that was found for a robot.

    Attributes:
        table: Of its tests.
        tests: Their folder.
        walk: Folder of a walk on the level, to look at.
        elsewhere: By the name of another engine, the folder and the table of its walk on the level there.
        absent: Names of engines that are not installed.
    """

    table: StandardTable
    tests: Path
    walk: Path
    elsewhere: dict[str, tuple[Path, StandardTable]]
    absent: list[str]


def is_model(name: str) -> bool:
    """Whether an argument of `biped tune` is a robot's model file, not a scenario."""
    return Path(name).suffix in (".xml", URDF)


def search_of(
    name: str, changes: Sequence[str], jobs: Jobs, progress: Progress = silent, without: Sequence[str] = (),
    stages: int | None = None,
) -> tuple[list[str], list[Trial]]:  # fmt: skip
    """The changes that make `tune/any` a search for a robot, and how far gaits came on it from each posture.

    The search is tried from the gaits that come furthest with joint torques alone, each from its best posture. A gait
    or a posture that the changes name is the only one.

    Args:
        name: Path of its model file.
        changes: `--set` changes, which come last.
        jobs: Number of processes, or a cluster.
        progress: Told of every run.
        without: Shipped gaits that are not tried, such as the robot's own.
        stages: How many of the search's stages are run; default: all.

    Raises:
        InputError: The law is not for this robot: the part that is another. There is no such gait, or no such stage.
    """
    for gait in without:
        if gait not in GAITS:
            raise InputError(f"--without {safe(gait)}: expected a gait that is tried; {nearest(gait, list(GAITS))}")
    report = look(name)
    if report.faults:
        raise InputError(f"{name}: {report.faults[0]}", "model")
    if report.not_spatial:
        raise InputError(report.not_spatial, "law")
    asked = [_stages(report.held, stages), *(_IN_PLANE if report.in_the_plane else ())]
    model = f'model="{locate("models", name, "model").resolve()}"'
    pace = f"tune.pace={_PACE * math.sqrt(GRAVITY * report.leg):.3g}"
    if any(change.partition("=")[0].strip() == "model" for change in changes):
        raise InputError(f"model: expected no change of it: {safe(name)} takes its place")
    own, origin = read(SCENARIO, [model, *changes])
    tried = tuple(gait for gait in GAITS if gait not in without)
    gaits = (own.controller,) if origin.keys["controller"] == COMMAND_LINE else tried
    postures = (own.start.posture,) if origin.keys.get("start.posture") == COMMAND_LINE else POSTURES
    cases = list(product(ASSISTS, gaits, postures))
    shipped = _Shipped((model, pace, *changes))
    with executor.workers(shipped, jobs) as carried_out, progress(name, len(cases), 0) as advance:
        found = []
        for one in carried_out(cases):
            found.append(one)
            advance()
    trials = []
    for i in range(0, len(cases), len(postures)):
        assist, gait, _ = cases[i]
        trials.append(Trial(gait, assist, *zip(*found[i : i + len(postures)], strict=True)))
    best = sorted((one for one in trials if not one.assist), key=lambda one: -max(one.earned))[:PLACES]
    places = [{"controller": one.gait, "posture": postures[one.earned.index(max(one.earned))]} for one in best]
    begin = setting("controller", best[0].gait), setting("tune.begin", places), setting("tune.postures", postures)
    return [model, *begin, pace, *asked, *changes], trials


def with_transitions(
    gait: Path, changes: Sequence[str], jobs: Jobs, progress: Progress = silent, tell: Told = unheard
) -> Path:
    """Searches for the gaits by which a walk stops and sets off, in folders beside it; returns a gait that names them.

    A gait that stops a walk nearly always is also the one from which the robot sets off: it bears more than
    `any/stand`.
    A search that finds nothing better leaves the walk the gait that it has, which is that of where its search began.

    Args:
        gait: The walk's file; what its folder already has of the searches is continued.
        changes: Of its search; these searches are made with those that say what the robot is.
        jobs: Number of processes, or a cluster.
        progress: Told of every generation.
        tell: Told what of an interrupted search could not be used.

    Raises:
        InputError: The file of the walk is there and was edited.
    """
    walk, own, named = gait.with_name("walk.toml"), _own(changes), dict[str, Any]()
    for to, search in SEARCHES.items():
        _write_walk(walk, gait, named)
        tuned = tune(search, [*own, f'controller="{walk}"'], jobs, gait.parent / to, progress, tell=tell)
        if tuned.found.cost < tuned.found.start_cost:
            named[to] = f"{to}/{tuned.gait.name}"
            named |= {word: tuned.keys[key] for key, word in _KEYS[to].items() if key in tuned.keys}
            if to == "stop" and all(one.walked >= _STANDS * one.runs for one in tuned.found.tallies.values()):
                named["stand"] = named[to]
    _write_walk(walk, gait, named)
    return walk


def _write_walk(path: Path, gait: Path, named: dict[str, Any]) -> None:
    """A gait file that adds to a walk the gaits by which it stops and sets off.

    Raises:
        InputError: There is a file of that name that this command did not write, or that was edited.
    """
    import tomli_w

    text = tomli_w.dumps({"extends": gait.name} | ({"transitions": named} if named else {}))
    try:
        old = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        old = ""
    except (OSError, ValueError):
        old = "something else"
    if old and old != _walk_text(old.partition("\n")[2]):
        raise InputError(f"{label(path)}: was edited; rename it, so that the same command can write it anew")
    write_text(path, _walk_text(text))


def _walk_text(text: str) -> str:
    """The text of a walk's file under a head that tells whether it was edited."""
    mark = blake2b(text.encode(), digest_size=8).hexdigest()
    return f"# The walk and the gaits by which it stops and sets off; edit a copy of it ({mark}).\n{text}"


def _own(changes: Sequence[str]) -> list[str]:
    """Changes that say what the robot is."""
    return [one for one in changes if one.partition("=")[0].partition(".")[0].strip() in ("model", *_KEPT)]


def verdict(
    gait: Path, changes: Sequence[str], jobs: Jobs, progress: Progress = silent, tell: Told = unheard
) -> RobotVerdict:
    """Puts a gait that was found for a robot to the tests, and makes a walk to look at, all beside the gait.

    Engines that move any robot, are not the tests' own and are installed see its walk on the level too.

    Args:
        gait: Its file, in the results folder of its search; what is there already of its tests is not made again.
        changes: Of the search; tests are made with those that say what the robot is.
        jobs: Number of processes, or a cluster.
        progress: Told of every finished run.
        tell: Told what of an interrupted campaign could not be used.
    """
    own = _own(changes)
    tests, walk = gait.parent / "tests", gait.parent / "walk"
    table = standard([str(gait)], [TESTS], own, jobs, tests, progress)
    alone = (f'controller="{gait}"', "randomise.runs=1", "randomise.draw={}")
    run(_LEVEL, [*own, *alone], jobs, walk, progress=progress, tell=tell)
    others = [name for name, engine in ENGINES.items() if engine.any_robot and engine.library]
    elsewhere = {}
    for name in others:
        if installed(ENGINES[name].library):
            there = gait.parent / f"tests_in_{name}"
            elsewhere[name] = there, standard([str(gait)], [_LEVEL], own, jobs, there, progress, [name])
    return RobotVerdict(table, tests, walk, elsewhere, [name for name in others if name not in elsewhere])


def _stages(joints: Sequence[str], count: int | None) -> str:
    """The change that has arms, waist and head stiff where one of so many stages asks for it."""
    tune = read_scenario(SCENARIO).tune
    stages = [] if tune is None else [{key: value for key, value in to_builtins(stage).items() if value}
                                      for stage in tune.stages]  # fmt: skip
    for stage in stages:
        if "robot" in stage.get("set", {}):
            stage["set"]["robot"] = {"rigid": list(joints)}
    if count is not None and not 1 <= count <= len(stages):
        raise InputError(f"--stages {count}: expected 1 … {len(stages)}")
    return setting("tune.stages", stages[:count])


class _Shipped:
    """Runs of shipped gaits on a robot.

    Args:
        changes: To `tune/any`.
    """

    def __init__(self, changes: tuple[str, ...]):
        self._changes = changes

    def __call__(self, case: tuple[float, str, str]) -> tuple[float, float, float]:
        """[s] until a run fell, [m] it came, and what that earns."""
        assist, gait, posture = case
        fixed = (f'controller="{gait}"', f"actuation.assist={assist}", f"start.posture={posture}", "start.jitter=0.0",
                 f"duration={_SECONDS}")  # fmt: skip
        s = read_scenario(SCENARIO, [*fixed, *self._changes])
        made = Plan(replace(s, tune=None)).run(0)
        numbers = measured(made)[1]
        came = math.nan if numbers["diverged"] else numbers["distance"]
        return numbers["time"], came, earned(numbers, s.tune or Tune(), made, "walked")
