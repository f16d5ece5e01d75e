"""Error against run time of a walk: what every numerical setting of the engines costs, and how wrong it is.

Two errors, since a walk is sensitive to its start: over a short horizon the trajectory itself is compared with one
from far smaller steps, from the same states, before small differences have grown; over the steady gait its mean speed
and net cost of transport are compared with those of the converged setting, with intervals. Control stays at the
scenario's rate, so that only the physics changes, but where the rate itself is what varies. Each engine is compared
with itself: how far the two are apart is for `biped compare`.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import msgspec
import numpy as np

from biped.base.errors import RunError
from biped.base.statistics import Z95
from biped.ensemble.campaign import run_one, simulate_planar
from biped.measure.metrics import measure
from biped.measure.metrics.energy import loss_per_step
from biped.measure.trajectory import Trajectory
from biped.robot.run import Run
from biped.scenario.keys import Window
from biped.studies.run import plan_of, title_of

SCENARIO = "level_slow_generalized"
"""Its strides repeat to 0.1 %, so that a difference of 0.1 % between settings can be told from chance."""

INTEGRATORS = ("Euler", "implicitfast", "implicit", "RK4", "discrete")
STEPS = (0.001, 0.0005, 0.00025, 0.000125)
REFERENCE = {
    "mujoco": ("simulation.integrator=RK4", "simulation.timestep=1.5625e-5"),
    "home": ("engine=home", "simulation.timestep=1.5625e-5"),
}
"""Settings of the short horizon's reference, by engine."""
CONVERGED = {
    "mujoco": ("simulation.integrator=RK4", "simulation.timestep=0.000125"),
    "home": ("engine=home", "simulation.timestep=0.000125"),
}
"""Settings of the converged gait: the finest candidate of the highest order."""
CANDIDATES = {"mujoco": "steps", "home": "home"}
"""Groups among whose cases the recommendation chooses."""

STARTS = 12
HORIZON = 0.1
"""[s] after each start over which trajectories are compared."""
GRID = 0.002
"""[s] between the moments at which they are: a tick of the slowest control."""

WALKS = ("randomise.runs=4", "start.jitter=0.002", "duration=20.0", "window.start=6.0", "window.end=20.0")
LEVELS = (0.001, 0.01, 0.05)
NOISE = 0.1
"""Relative difference in CPU time that says nothing: the scenario's own setting is kept if none is cheaper by more."""
MEASURED = ("speed", "cost_of_transport", "penetration", "slip", "loss_per_step")


class Case(NamedTuple):
    """One setting.

    Attributes:
        group: What it varies; `steps` and `home` are candidates of the recommendation, the rest change the model of
            contact, the solver or the controller.
        label: In words.
        changes: Keys it changes.
    """

    group: str
    label: str
    changes: tuple[str, ...]

    @property
    def engine(self) -> str:
        """The engine it runs in."""
        return "home" if self.group == "home" else "mujoco"


def cases() -> list[Case]:
    """Every setting that is compared."""
    out = [
        Case("steps", f"{integrator} {1e3 * step:g} ms",
             (f"simulation.integrator={integrator}", f"simulation.timestep={step}"))
        for integrator in INTEGRATORS for step in STEPS
    ]  # fmt: skip
    out += [Case("tolerance", f"tolerance {t:g}", (f"simulation.tolerance={t}",)) for t in (1e-2, 1e-4, 1e-6, 1e-12)]
    out += [Case("contact", f"contact time {1e3 * t:g} ms", (f"ground.contact_time={t}",))
            for t in (0.002, 0.008, 0.016)]  # fmt: skip
    out.append(Case("contact", "pyramidal cone", ("simulation.cone=pyramidal",)))
    out += [Case("contact", f"impratio {i:g}", (f"simulation.impratio={i}",)) for i in (1.0, 100.0)]
    out += [
        Case("control", f"control at {rate} Hz",
             (f"simulation.control_rate={rate}.0", f"simulation.timestep={min(0.001, 1.0 / rate)}"))
        for rate in (500, 2000, 4000, 8000)
    ]  # fmt: skip
    out += [Case("home", f"home {1e3 * step:g} ms", ("engine=home", f"simulation.timestep={step}")) for step in STEPS]
    return out


def starts(name: str, changes: Sequence[str]) -> tuple[Run, Trajectory, np.ndarray]:
    """A run, its trajectory, and rows spread over its last two seconds: states that a walk passes through.

    Raises:
        RunError: The scenario does not stay up.
    """
    run = plan_of(name, changes).run(0)
    t = simulate_planar(run)
    if t.end != "completed":
        raise RunError(f"{name}: {t.cause}; expected a scenario that walks to its end")
    last = len(t) - 1
    return run, t, np.linspace(last - round(2.0 / t.tick), last, STARTS).astype(int)


def short(run: Run, t: Trajectory, rows: np.ndarray) -> np.ndarray:
    """Joint angles and pitch (STARTS, n, 7) [rad] every `GRID` over the horizon from each of a trajectory's rows."""
    s = msgspec.structs.replace(run.scenario, duration=HORIZON, window=Window(), push=(), change=())
    out = []
    for row in rows:
        walked = simulate_planar(replace(run, q=t.q[row].copy(), v=t.v[row].copy(), scenario=s))
        angle = np.full((round(HORIZON / GRID), 7), math.nan)
        there = walked.q[:: round(GRID / walked.tick), 2:]
        angle[: len(there)] = there
        out.append(angle)
    return np.array(out)


def halves(t: Trajectory, start: float) -> list[tuple[float, float]]:
    """Two windows [s] of whole strides after `start`, none if the walk is too short.

    A fraction of a stride more or less changes the mean power by percents. Halves of a walk are nearly independent.
    """
    marks = [float(t.time[row]) for row, leg in t.strikes if leg == 0 and t.time[row] >= start]
    if t.end != "completed" or len(marks) < 3:
        return []
    middle = marks[len(marks) // 2]
    return [(marks[0], middle), (middle, marks[-1])]


def steady(name: str, changes: Sequence[str]) -> dict[str, Any]:
    """Means and 95 % half-widths over walks of a setting, and the least CPU time per second of walking of them."""
    plan = plan_of(name, [*changes, *WALKS])
    rows: list[dict[str, Any]] = []
    clock, fell = [], 0
    for index in range(len(plan)):
        before = time.process_time()
        trajectory, row = run_one(plan, index)
        clock.append((time.process_time() - before) / row.time)
        fell += row.fell
        for window in halves(trajectory, plan.scenario.interval[0]):
            rows.append(measure(trajectory, window) | {"loss_per_step": loss_per_step(trajectory, window)})
    if len(rows) < 2:
        raise RunError(f"{name} with {', '.join(changes)}: {fell} of {len(plan)} walks fell; no steady gait to measure")
    out: dict[str, Any] = {"cpu_per_second": min(clock), "fell": fell}
    for metric in MEASURED:
        values = np.array([r[metric] for r in rows])
        out[metric] = float(values.mean())
        out[f"{metric}_half_width"] = float(Z95 * values.std(ddof=1) / math.sqrt(len(values)))
    return out


def compare(name: str = SCENARIO, chosen: Sequence[Case] | None = None) -> dict[str, Any]:
    """Measures every case against the references.

    Args:
        name: Scenario that walks.
        chosen: Cases; default: all.
    """
    chosen = cases() if chosen is None else chosen
    walks, fine, converged = {}, {}, {}
    for engine in dict.fromkeys(case.engine for case in chosen):
        changes = ["duration=12.0", "window.start=6.0", "window.end=12.0", f"engine={engine}"]
        walks[engine] = starts(name, changes)[1:]
        fine[engine] = short(plan_of(name, REFERENCE[engine]).run(0), *walks[engine])
        converged[engine] = steady(name, CONVERGED[engine]) | {"settings": list(CONVERGED[engine])}
    own = plan_of(name, []).scenario.simulation
    table = []
    for case in chosen:
        plan = plan_of(name, case.changes)
        angle = short(plan.run(0), *walks[case.engine])
        error = np.abs(angle - fine[case.engine]).max(axis=(1, 2))
        row = {"group": case.group, "label": case.label, "settings": list(case.changes),
               "own": plan.scenario.simulation == own}  # fmt: skip
        row |= {"error": float(np.median(error)), "error_largest": float(error.max())} | steady(name, case.changes)
        for metric in ("speed", "cost_of_transport"):
            best = converged[case.engine]
            shift = row[metric] / best[metric] - 1.0
            half = math.hypot(row[f"{metric}_half_width"], best[f"{metric}_half_width"]) / best[metric]
            row[f"{metric}_shift"], row[f"{metric}_shift_half_width"] = shift, half
        table.append(row)
    return {
        "scenario": title_of(name),
        "horizon": HORIZON,
        "reference": {engine: list(REFERENCE[engine]) for engine in fine},
        "converged": converged,
        "cases": table,
        "recommended": [recommend(table, level, engine) for engine in fine for level in LEVELS],
    }


def within(row: dict[str, Any], level: float) -> bool:
    """Whether speed and cost of transport, intervals included, are within a level of the converged gait's."""
    return row["fell"] == 0 and all(
        abs(row[f"{metric}_shift"]) + row[f"{metric}_shift_half_width"] <= level
        for metric in ("speed", "cost_of_transport")
    )


def recommend(table: Sequence[dict[str, Any]], level: float, engine: str = "mujoco") -> dict[str, Any]:
    """The cheapest integrator and step within a level of an engine's converged gait; no label if there is none."""
    good = [row for row in table if row["group"] == CANDIDATES[engine] and within(row, level)]
    if not good:
        return {"engine": engine, "level": level, "label": None, "settings": []}
    best = min(good, key=lambda row: row["cpu_per_second"] * (1.0 if row["own"] else 1.0 + NOISE))
    return {"engine": engine, "level": level, "label": best["label"], "settings": best["settings"]}
