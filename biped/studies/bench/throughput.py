"""What a control tick and a run cost, as ratios to bare `mj_step` of the same compiled model, in one run.

Bare `mj_step` replays the recorded torques of the same trajectory, so that it meets the same contacts; the cost of
handing over the torques is measured by itself and subtracted.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from biped.engines.mujoco import simulate
from biped.ensemble import campaign
from biped.ensemble.executor import workers
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.reading import read_scenario
from biped.studies.bench.parts import contact_costs, replay, tick_parts
from biped.studies.bench.scenes import loop_of, scene_costs

REPEATS = 7
ENSEMBLE = 40
COMMANDS = (["--help"], ["list"], ["run", "level_normal", "--json"])


class Throughput(NamedTuple):
    """What was measured.

    Attributes:
        loop: How ticks are looped over: compiled, or in Python and why.
        tick: µs per control tick by part; ratios without unit.
        contacts: µs of a bare `mj_step` by points on the ground.
        campaign: Of an ensemble, wall time in s.
        cold_start: CPU seconds by command.
        scenes: Costs by scene (`biped.studies.bench.scenes`); None if they were left out.
        features: Prices by feature (`biped.studies.bench.features`); None likewise.
    """

    loop: str
    tick: dict[str, float]
    contacts: dict[int, float]
    campaign: dict[str, float]
    cold_start: dict[str, float]
    scenes: dict[str, dict[str, Any]] | None
    features: dict[str, dict[str, Any]] | None

    def as_dict(self) -> dict[str, Any]:
        """What `--json` prints."""
        return {name: value for name, value in self._asdict().items() if value is not None}


def tick_costs(name: str = "level_normal") -> dict[str, float]:
    """µs per control tick of a scenario by part, and a run's ratios to bare `mj_step`, without and with metrics."""
    plan = Plan(read_scenario(name))
    run = plan.run(0)
    trajectory = simulate(run)  # compiles
    measure(trajectory, run.scenario.interval)
    return tick_parts(run, trajectory)


def compiled(name: str = "level_normal") -> str:
    """How a scenario's ticks are looped over: compiled, or in Python and why."""
    return loop_of(Plan(read_scenario(name)).run(0))


def contacts(name: str = "level_normal") -> dict[int, float]:
    """µs of a bare `mj_step` of a scenario by the number of points on the ground."""
    run = Plan(read_scenario(name)).run(0)
    return contact_costs(run, simulate(run))


def _replay_again(run: Run, trajectory: Trajectory, _: int) -> None:
    replay(run, trajectory)


def ensemble_costs(name: str = "level_normal", jobs: int | None = None) -> dict[str, float]:
    """Wall time of an ensemble with metrics on all cores, and its ratio to as many bare steps on as many cores."""
    jobs = campaign.cores() if jobs is None else jobs
    plan = Plan(read_scenario(name, [f"randomise.runs={ENSEMBLE}", "start.jitter=0.002"]))
    first = plan.run(0)
    trajectory = simulate(first)
    measure(trajectory, first.scenario.interval)  # compiles
    with workers(partial(_replay_again, first, trajectory), jobs) as again:
        list(again(range(jobs)))  # starts the workers
        start = time.perf_counter()
        list(again(range(ENSEMBLE)))
        bare = (time.perf_counter() - start) / (ENSEMBLE * len(trajectory))
    start = time.perf_counter()
    with campaign.rows_of(plan, range(ENSEMBLE), jobs) as rows:
        ticks = sum(round(row.time * plan.scenario.simulation.control_rate) for row in rows)
    wall = time.perf_counter() - start
    return {
        "runs": ENSEMBLE,
        "jobs": jobs,
        "wall": wall,
        "runs_per_second": ENSEMBLE / wall,
        "ratio": wall / (bare * ticks),
    }


def cold_starts() -> dict[str, float]:
    """CPU seconds of whole commands, from start to exit."""
    import resource

    out = {}
    for command in COMMANDS:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        call = [
            sys.executable,
            "-m",
            "biped.cli.main",
            *command,
            *(["--set", "duration=10.0"] if "run" in command else []),
        ]
        subprocess.run(call, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        out["biped " + " ".join(command)] = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return out


def everything(quick: bool = False, recorder: Callable[..., None] | None = None) -> Throughput:
    """Measures everything.

    Args:
        quick: Leave out scenes of every kind, and the prices of features, which take a process each.
        recorder: Writes a run's recording; its price is left out without one (`biped.show.replay.record_runs`).
    """
    costs = compiled(), tick_costs(), contacts(), ensemble_costs(), cold_starts()
    if quick:
        return Throughput(*costs, None, None)
    from biped.studies.bench.features import prices

    return Throughput(*costs, scene_costs(), prices(recorder=recorder))
