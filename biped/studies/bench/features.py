"""Costs of each feature of a scene, and proof that a scene without it does not pay: each in a process of its own.

A process runs one scenario and reports what it imported, which kernels it compiled or loaded, and what memory and time
a tick took, beside bare `mj_step` in the same process.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

BASE = "level_normal"
SECONDS = 2.0

FEATURES: dict[str, tuple[str, ...]] = {
    "plain": (),
    "every touching point in A": ("actuation.contacts='touching'",),
    "ground that only pushes": ("actuation.contacts='pushing'", "controller='calm'"),
    "Q_d itself": ("actuation.mode='generalized'",),
    "u_0 of (4.7)": ("actuation.null_torque=[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]",),
    "model error": ("randomise.controller_mass_matrix=1e-6", "randomise.controller_constraints=1e-6"),
    "actuator lag": ("actuation.lag=0.001",),
    "sensor noise": ("sensors.angle_noise=1e-5", "sensors.rate_noise=1e-4"),
    "sensor delay": ("sensors.delay=0.001",),
    "push": ("push=[{at=0.0, duration=0.1, force=[50.0, 0.0]}]",),
    "wrong masses": ("truth.mass=[1.01, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]",),
    "torque limit, bounded form": ("actuation.limit='bounded'", "actuation.torque_limit=60.0"),
    "torque limit by OSQP": (
        "actuation.limit='bounded'",
        "actuation.torque_limit=60.0",
        "actuation.solver='osqp'",
    ),
    "change of gains": ("change=[{at=0.5, over=0.5, gains={k_d1=710.0}}]",),
    "physics at 0.5 ms": ("simulation.timestep=0.0005",),
    "RK4": ("simulation.integrator='RK4'",),
    "pyramidal cone": ("simulation.cone='pyramidal'",),
    "home engine": ("engine='home'",),
    "recording": (),
}
"""Changes of the base scenario by feature; `recording` writes one."""

_PROBE = "from sys import argv; from biped.studies.bench.features import probe; probe(argv[1], float(argv[2]), argv[3])"


def probe(feature: str, seconds: float, recorder: str = "") -> None:
    """Runs the base scenario with a feature and prints, as JSON, what that took; for a fresh process.

    Args:
        feature: One of `FEATURES`.
        seconds: Simulated.
        recorder: What writes a recording, as `module:function`.
    """
    import tracemalloc

    from biped.engines.planar.mujoco import simulate as simulate_mujoco
    from biped.ensemble.campaign import simulate
    from biped.ensemble.plan import Plan
    from biped.scenario.reading import read_scenario
    from biped.studies.bench.replay import bare, clock, replay_of

    before = set(sys.modules)
    base = [f"duration={seconds}", f"window.start={seconds / 2}", f"window.end={seconds}"]
    plan = Plan(read_scenario(BASE, [*base, *FEATURES[feature]]))
    run = plan.run(0)
    work = lambda: simulate(run)  # noqa: E731
    trajectory = work()
    if feature == "recording":
        work = _recorded(plan, recorder)
        work()
    imported = sorted(set(sys.modules) - before)
    kernels = _kernels()
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    plain = Plan(read_scenario(BASE, base)).run(0)
    reference = simulate_mujoco(plain)
    again = replay_of(plain, reference)
    times = [(clock(work) / len(trajectory), bare(again) / len(reference)) for _ in range(3)]
    ratio = sorted(a / b for a, b in times)[1]
    packages = sorted({_package(name) for name in imported} - {""})
    out = {"tick": min(a for a, _ in times) * 1e6, "ratio": ratio, "imported": packages, "kernels": kernels,
           "memory": peak / 1e6}  # fmt: skip
    print(json.dumps(out))


def _recorded(plan: Any, recorder: str) -> Callable[[], None]:
    """A call that simulates the plan's run and writes its recording."""
    from biped.ensemble.campaign import run_one
    from biped.ensemble.results import result_of

    module, _, name = recorder.partition(":")
    record_runs = getattr(import_module(module), name)
    row = run_one(plan, 0)[1]
    path = Path(tempfile.mkdtemp()) / "recording.rrd"

    def work() -> None:
        record_runs(path, plan, result_of(BASE, plan, [row]), {})

    return work


def _package(module: str) -> str:
    """The name that a module counts under: biped's own by name, others by package; empty for parts of Python."""
    top = module.partition(".")[0]
    if top == "biped":
        return module
    return "" if top in sys.stdlib_module_names or top.startswith("_") else top


def _kernels() -> list[str]:
    """Names of biped's kernels that were compiled, or loaded from the cache, so far."""
    found = set()
    for name, module in list(sys.modules.items()):
        if name.startswith("biped"):
            for value in vars(module).values():
                if getattr(value, "signatures", None) and hasattr(value, "py_func"):
                    found.add(f"{value.__module__.removeprefix('biped.')}.{value.__name__}")
    return sorted(found)


def prices(
    features: Sequence[str] = tuple(FEATURES), seconds: float = SECONDS, recorder: Callable[..., None] | None = None
) -> dict[str, dict[str, Any]]:
    """Measures the costs of features.

    Args:
        features: Names of `FEATURES`, the plain scene first.
        seconds: Simulated in each process.
        recorder: Writes a run's recording (path, plan, result, trajectories); a recording has no price without one.

    Returns:
        For each its `tick` [µs], its `ratio` to bare `mj_step` of the plain scene, `memory` [MB] of a run, what it
        `imported` and which `kernels` it compiled; `only_imported` and `only_kernels` are those the plain scene lacks.
    """
    found: dict[str, dict[str, Any]] = {}
    name = "" if recorder is None else f"{recorder.__module__}:{recorder.__qualname__}"
    for feature in features:
        if feature == "recording" and recorder is None:
            continue
        command = [sys.executable, "-c", _PROBE, feature, str(seconds), name]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        found[feature] = json.loads(done.stdout.splitlines()[-1])
    plain = found[features[0]]
    for entry in found.values():
        for key in ("imported", "kernels"):
            entry[f"only_{key}"] = [name for name in entry[key] if name not in plain[key]]
    return found
