"""What a control tick and a run cost, as ratios to bare `mj_step` of the same compiled model, in one run.

Bare `mj_step` replays the recorded torques of the same trajectory, so that it meets the same contacts; the cost of
handing over the torques is measured by itself and subtracted.
"""

from __future__ import annotations

import subprocess
import sys
import time
from functools import partial
from typing import Any

from biped.control.controller import python_needed
from biped.engines.mujoco import simulate
from biped.engines.native import reason
from biped.ensemble import campaign
from biped.ensemble.executor import workers
from biped.ensemble.plan import Plan
from biped.measure.metrics import measure
from biped.measure.trajectory import Trajectory
from biped.robot.model import compile_foreign, tree_at
from biped.robot.run import Run
from biped.scenario.reading import read_scenario
from biped.studies.bench.parts import contact_costs, replay, tick_parts

REPEATS = 7
ENSEMBLE = 40
COMMANDS = (["--help"], ["list"], ["run", "level_normal", "--json"])


def tick_costs(name: str = "level_normal") -> dict[str, float]:
    """µs per control tick of a scenario by part, and a run's ratios to bare `mj_step`, without and with metrics."""
    plan = Plan(read_scenario(name))
    run = plan.run(0)
    trajectory = simulate(run)  # compiles
    measure(trajectory, run.scenario.interval)
    return tick_parts(run, trajectory)


def compiled(name: str = "level_normal") -> str:
    """How a scenario's ticks are looped over: compiled, or in Python and why."""
    run = Plan(read_scenario(name)).run(0)
    foreign = compile_foreign(run.model, run.scenario)
    why = python_needed(run, tree_at(run.model)) or reason(foreign.model, foreign.order)
    return f"in Python: {why}" if why else "compiled"


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


def run(json: bool = False, quick: bool = False) -> dict[str, Any]:
    """Measures everything and prints it, as tables or as one JSON object.

    Args:
        json: Print JSON.
        quick: Leave out the prices of features, which take a process each.
    """
    result: dict[str, Any] = {
        "loop": compiled(), "tick": tick_costs(), "contacts": contacts(), "campaign": ensemble_costs(),
        "cold_start": cold_starts(),
    }  # fmt: skip
    if not quick:
        from biped.studies.bench.features import prices

        result["features"] = prices()
    if json:
        from biped.base.json import dumps

        print(dumps(result))
    else:
        _show(result)
    return result


def _show(result: dict[str, Any]) -> None:
    from biped.show.terminal import console, number, table

    out = console()
    units = {"tick": "µs a tick (ratios without unit)", "contacts": "µs of mj_step by points on the ground",
             "campaign": "wall time in s", "cold_start": "s of CPU"}  # fmt: skip
    out.print(f"[bold]loop[/bold] {result['loop']}")
    for part, unit in units.items():
        out.print(f"[bold]{part}[/bold] [dim]{unit}[/dim]")
        for key, value in result[part].items():
            out.print(f"  {key!s:<36}{number(value)}")
    if "features" in result:
        out.print("[bold]features[/bold] [dim]of a scene, each in a process of its own[/dim]")
        words = ("feature", "what only it imports")
        page = table((words[0], "µs a tick", "x mj_step", "MB", words[1]), words)
        for name, price in result["features"].items():
            cells = [number(price[key]) for key in ("tick", "ratio", "memory")]
            page.add_row(name, *cells, ", ".join(price["only_imported"]))
        out.print(page)
