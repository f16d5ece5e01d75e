"""Costs of a control tick and of a run, as ratios to bare `mj_step` of the same compiled model, in one run.

Bare `mj_step` replays the recorded torques of the same trajectory, so that it meets the same contacts; the cost of
handing over the torques is measured by itself and subtracted.

The benchmark that guards fails when a result changed, and says when a tick got slower. Ratios mean the same on a busy
or a slow machine; yet they are measurements, and a slow one is no failure.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from biped.base.errors import BipedError
from biped.engines.planar.mujoco import simulate
from biped.ensemble import campaign, journal
from biped.ensemble.executor import workers
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.reading import read_scenario
from biped.studies.bench.parts import contact_costs, rigid_parts, tick_parts
from biped.studies.bench.replay import bare, replay_of
from biped.studies.bench.scenes import loop_of, robot_costs, scene_costs
from biped.studies.regress.references import RecordedScenario, TickCost, digest, read, shipped, write
from biped.studies.run import plan_of, title_of

REPEATS = 7
ENSEMBLE = 100
STARTS = 5
COMMANDS = (("--help",), ("list",), ("run", "level_normal", "--json", "--set", "duration=10.0"))


class Throughput(NamedTuple):
    """All measured costs.

    Attributes:
        loop: How ticks are looped over: compiled, or in Python and why.
        tick: µs per control tick by part; ratios without unit.
        home: µs per control tick of the home engine by part (`biped.studies.bench.parts`).
        contacts: µs of a bare `mj_step` by points on the ground.
        campaign: Of an ensemble; see `ensemble_costs`.
        cold_start: CPU seconds by command.
        scenes: Costs by scene (`biped.studies.bench.scenes`); None if they were left out.
        robots: Costs of robots of any kind (`biped.studies.bench.scenes`); None likewise.
        features: Prices by feature (`biped.studies.bench.features`); None likewise.
    """

    loop: str
    tick: dict[str, float]
    home: dict[str, float]
    contacts: dict[int, float]
    campaign: dict[str, float]
    cold_start: dict[str, float]
    scenes: dict[str, dict[str, Any]] | None
    robots: dict[str, dict[str, Any]] | None
    features: dict[str, dict[str, Any]] | None

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {name: value for name, value in self._asdict().items() if value is not None}


def tick_costs(name: str = "level_normal") -> dict[str, float]:
    """µs per control tick of a scenario by part, and a run's ratios to bare `mj_step`, without and with metrics."""
    plan = Plan(read_scenario(name))
    run = plan.run(0)
    trajectory = simulate(run)  # compiles
    measure(trajectory, run.scenario.interval)
    return tick_parts(run, trajectory)


def home_costs(name: str = "level_normal_generalized") -> dict[str, float]:
    """µs per control tick of a scenario in the home engine by part."""
    return rigid_parts(Plan(read_scenario(name)).run(0))


def compiled(name: str = "level_normal") -> str:
    """How a scenario's ticks are looped over: compiled, or in Python and why."""
    return loop_of(Plan(read_scenario(name)).run(0))


def contacts(name: str = "level_normal") -> dict[int, float]:
    """µs of a bare `mj_step` of a scenario by the number of points on the ground."""
    run = Plan(read_scenario(name)).run(0)
    return contact_costs(run, simulate(run))


def _bare_again(run: Run, trajectory: Trajectory, _: int) -> float:
    return bare(replay_of(run, trajectory))


def ensemble_costs(name: str = "level_normal", jobs: int | None = None, runs: int | None = None) -> dict[str, float]:
    """An ensemble with metrics on all cores, the whole command, against as many bare steps on as many cores.

    Returns:
        `cpu` [s] of the command's processes together and its `ratio` to that of the steps; `wall` [s] and
        `runs_per_second`, which mean something on an idle machine.
    """
    jobs = campaign.cores() if jobs is None else jobs
    runs = ENSEMBLE if runs is None else runs
    changes = [f"randomise.runs={runs}", "start.jitter=0.002"]
    plan = Plan(read_scenario(name, changes))
    first = plan.run(0)
    trajectory = simulate(first)
    measure(trajectory, first.scenario.interval)  # compiles
    with workers(partial(_bare_again, first, trajectory), jobs) as again:
        list(again(range(jobs)))  # starts the workers
        step = sum(again(range(runs))) / (runs * len(trajectory))
    with tempfile.TemporaryDirectory(prefix="biped-") as scratch:
        words = [word for change in changes for word in ("--set", change)]
        began = time.perf_counter()
        cpu, said = _command("run", name, *words, "--jobs", str(jobs), "--json", "--out", str(Path(scratch) / "out"))
        wall = time.perf_counter() - began
    ticks = sum(round(run["time"] * plan.scenario.simulation.control_rate) for run in json.loads(said)["runs"])
    return {
        "runs": runs,
        "jobs": jobs,
        "cpu": cpu,
        "ratio": cpu / (step * ticks),
        "wall": wall,
        "runs_per_second": runs / wall,
    }


def _command(*words: str) -> tuple[float, str]:
    """CPU seconds of a command of biped, from start to exit, and what it printed; others must not end meanwhile."""
    import resource

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    call = [sys.executable, "-m", "biped.cli.main", *words]
    done = subprocess.run(call, check=False, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1):  # 1: an expectation of a scenario is not met
        raise BipedError(f"biped {' '.join(words)}: {done.stderr.strip()}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def cold_starts() -> dict[str, float]:
    """CPU seconds of whole commands, from start to exit, the least of a few."""
    out = {}
    for words in COMMANDS:
        with tempfile.TemporaryDirectory(prefix="biped-") as scratch:
            folders = [["--out", str(Path(scratch) / str(k))] if words[0] == "run" else [] for k in range(STARTS)]
            out["biped " + " ".join(words)] = min(_command(*words, *folder)[0] for folder in folders)
    return out


def everything(quick: bool = False, recorder: Callable[..., None] | None = None) -> Throughput:
    """Measures everything.

    Args:
        quick: Leave out scenes and robots of every kind, and the prices of features, which take a process each.
        recorder: Writes a run's recording; its price is left out without one (`biped.show.replay.record_runs`).
    """
    costs = compiled(), tick_costs(), home_costs(), contacts(), ensemble_costs(), cold_starts()
    if quick:
        return Throughput(*costs, None, None, None)
    from biped.studies.bench.features import prices

    return Throughput(*costs, scene_costs(), robot_costs(), prices(recorder=recorder))


SCENARIOS = ("level_normal", "level_normal_generalized", "robust/own")
"""Joint torques, none, and one tangential row per foot."""
SLOWER = 0.25
"""Relative increase of a cost that is reported."""

SAME, CHANGED, ELSEWHERE, UNKNOWN = "same", "CHANGED", "recorded on another platform", "no reference"


class Timed(NamedTuple):
    """One scenario, timed.

    Attributes:
        scenario: Its name.
        result: What became of its result.
        old: Recorded cost; None if there is none.
        new: Measured cost.
        slower: Relative change of the closed loop's cost, or of that with metrics if that is more; 0 without a record.
    """

    scenario: str
    result: str
    old: TickCost | None
    new: TickCost
    slower: float


def judged(
    name: str, reference: RecordedScenario | None, old: TickCost | None, new: TickCost, bits: str, here: str
) -> Timed:
    """Compares result and cost of a scenario with what was recorded.

    Args:
        name: The scenario.
        reference: Its reference; its first run is the scenario itself.
        old: Its recorded cost.
        new: Its cost now.
        bits: Digest of the timed run.
        here: Key of this platform.
    """
    if reference is None:
        result = UNKNOWN
    elif reference.platform != here:
        result = ELSEWHERE
    else:
        result = SAME if reference.digests[0] == bits else CHANGED
    slower = 0.0 if old is None else max(new.loop / old.loop, new.metrics / old.metrics) - 1.0
    return Timed(name, result, old, new, slower)


class Guarded(NamedTuple):
    """Results and costs beside what was recorded.

    Attributes:
        timed: By scenario.
    """

    timed: list[Timed]

    @property
    def passed(self) -> bool:
        """Whether all results are as recorded, where that can be told."""
        return all(one.result in (SAME, ELSEWHERE) for one in self.timed)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {"passed": self.passed, "scenarios": [msgspec.to_builtins(one._asdict()) for one in self.timed]}


def guard(file: Path | None = None, reason: str | None = None) -> Guarded:
    """Times scenarios and compares with what was recorded.

    Args:
        file: File of references; default: that of the shipped scenarios.
        reason: Why costs changed: records them. Results are recorded by `biped regress --update`.
    """
    path = shipped() if file is None else file
    references = read(path)
    here = journal.key(journal.here())
    timed = []
    for name in SCENARIOS:
        costs = tick_costs(name)
        new = TickCost(date.today().isoformat(), reason or "", *(round(costs[f"ratio_{part}"], 2) for part in
                                                            ("loop", "with_metrics")))  # fmt: skip
        bits = digest(campaign.simulate(plan_of(name, ()).run(0)))
        title = title_of(name)
        timed.append(judged(title, references.scenarios.get(title), references.costs.get(title), new, bits, here))
    if reason is not None:
        references.costs |= {one.scenario: one.new for one in timed}
        write(path, references)
    return Guarded(timed)
