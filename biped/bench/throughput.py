"""What a control tick and a run cost, as ratios to bare `mj_step` of the same compiled model, in one run.

Bare `mj_step` replays the recorded torques of the same trajectory, so that it meets the same contacts; the cost of
handing over the torques is measured by itself and subtracted.
"""

from __future__ import annotations

import multiprocessing
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from biped import campaign
from biped.engines.mujoco import simulate
from biped.metrics import measure
from biped.model import compile_foreign
from biped.plan import Plan, Run
from biped.reading import read_scenario
from biped.trajectory import Trajectory

REPEATS = 7
ENSEMBLE = 40
COMMANDS = (["--help"], ["list"], ["run", "level_normal", "--json"])


def _clock(work: Callable[[], Any]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def _replay(run: Run, trajectory: Trajectory, step: bool) -> None:
    """Replays recorded torques through bare MuJoCo; without `step`, only hands them over."""
    model = compile_foreign(run.model, run.scenario).model
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = run.q, run.v
    ctrl, u, mj_step = data.ctrl, np.ascontiguousarray(trajectory.u), mujoco.mj_step
    if step:
        for k in range(len(u)):
            ctrl[:] = u[k]
            mj_step(model, data)
    else:
        for k in range(len(u)):
            ctrl[:] = u[k]


def tick_costs(name: str = "level_normal") -> dict[str, float]:
    """µs per control tick of a scenario: bare step, closed loop, with metrics; and their ratios to the bare step."""
    plan = Plan(read_scenario(name))
    run = plan.run(0)
    trajectory = simulate(run)  # compiles
    measure(trajectory, run.scenario.interval)
    bare, loop, metrics = [], [], []
    for _ in range(REPEATS):
        bare.append(_clock(lambda: _replay(run, trajectory, True)) - _clock(lambda: _replay(run, trajectory, False)))
        loop.append(_clock(lambda: simulate(run)))
        metrics.append(_clock(lambda: measure(trajectory, run.scenario.interval)))
    per_tick = {
        "bare_mj_step": statistics.median(bare),
        "closed_loop": statistics.median(loop),
        "metrics": statistics.median(metrics),
    }
    out = {key: value / len(trajectory) * 1e6 for key, value in per_tick.items()}
    out["ratio_loop"] = statistics.median(a / b for a, b in zip(loop, bare, strict=True))
    out["ratio_with_metrics"] = statistics.median((a + c) / b for a, b, c in zip(loop, bare, metrics, strict=True))
    return out


def _replay_again(argument: tuple[Run, Trajectory]) -> None:
    _replay(*argument, step=True)


def ensemble_costs(name: str = "level_normal", jobs: int | None = None) -> dict[str, float]:
    """Wall time of an ensemble with metrics on all cores, and its ratio to as many bare steps on as many cores."""
    jobs = campaign.cores() if jobs is None else jobs
    plan = Plan(read_scenario(name, [f"randomise.runs={ENSEMBLE}", "start.jitter=0.002"]))
    first = plan.run(0)
    trajectory = simulate(first)
    measure(trajectory, first.scenario.interval)  # compiles
    work = [(first, trajectory)] * ENSEMBLE
    with multiprocessing.Pool(jobs) as pool:
        pool.map(_replay_again, work[:jobs])  # starts the workers
        start = time.perf_counter()
        pool.map(_replay_again, work, chunksize=1)
        bare = (time.perf_counter() - start) / (ENSEMBLE * len(trajectory))
    start = time.perf_counter()
    with campaign.rows_of(plan, range(ENSEMBLE), jobs) as rows:
        ticks = sum(round(row["time"] * plan.scenario.simulation.control_rate) for row in rows)
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
        call = [sys.executable, "-m", "biped.cli", *command, *(["--set", "duration=10.0"] if "run" in command else [])]
        subprocess.run(call, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        out["biped " + " ".join(command)] = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return out


def run(json: bool = False) -> dict[str, Any]:
    """Measures everything and prints it, as tables or as one JSON object."""
    result = {"tick": tick_costs(), "campaign": ensemble_costs(), "cold_start": cold_starts()}
    if json:
        from biped.results import dumps

        print(dumps(result))
        return result
    from biped.terminal import console, number

    out = console()
    units = {"tick": "µs a tick (ratios without unit)", "campaign": "s wall", "cold_start": "s of CPU"}
    for part, values in result.items():
        out.print(f"[bold]{part}[/bold] [dim]{units[part]}[/dim]")
        for key, value in values.items():
            out.print(f"  {key:<36}{number(value)}")
    return result
