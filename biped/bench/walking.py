"""Error against run time of a walk: what every numerical setting of MuJoCo costs, and how wrong it is.

Two errors, since a walk is sensitive to its start: over a short horizon the trajectory itself is compared with one
from far smaller steps, from the same states, before small differences have grown; over the steady gait its mean speed
and net cost of transport are compared with those of the converged setting, with intervals. Control stays at the
scenario's rate throughout, so that only the physics changes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from biped.campaign import run_one, simulate
from biped.commands import plan_of, title_of
from biped.errors import RunError
from biped.metrics import measure
from biped.metrics.gait import strikes
from biped.plan import Run
from biped.scenario import Window
from biped.statistics import Z95
from biped.trajectory import Trajectory

SCENARIO = "level_slow_generalized"
"""Its strides repeat to 0.1 %, so that a difference of 0.1 % between settings can be told from chance."""

INTEGRATORS = ("Euler", "implicitfast", "implicit", "RK4", "discrete")
STEPS = (0.001, 0.0005, 0.00025, 0.000125)
REFERENCE = ("simulation.integrator=RK4", "simulation.timestep=1.5625e-5")
"""Settings of the short horizon's reference."""
CONVERGED = ("simulation.integrator=RK4", "simulation.timestep=0.000125")
"""Settings of the converged gait: the finest candidate of the highest order."""

STARTS = 12
HORIZON = 0.1
"""[s] after each start over which trajectories are compared."""

WALKS = ("randomise.runs=4", "start.jitter=0.002", "duration=20.0", "window.start=6.0", "window.end=20.0")
LEVELS = (0.001, 0.01, 0.05)
MEASURED = ("speed", "cost_of_transport", "penetration", "slip", "contact_loss", "energy_residual")


class Case(NamedTuple):
    """One setting.

    Attributes:
        group: What it varies; `steps` are candidates of the recommendation, the rest change the model of contact or
            the solver at the scenario's own step.
        label: In words.
        changes: Keys it changes.
    """

    group: str
    label: str
    changes: tuple[str, ...]


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
    return out


def starts(name: str, changes: Sequence[str]) -> tuple[Run, Trajectory, np.ndarray]:
    """A run, its trajectory, and rows spread over its last two seconds: states that a walk passes through.

    Raises:
        RunError: The scenario does not stay up.
    """
    run = plan_of(name, changes).run(0)
    t = simulate(run)
    if t.end != "completed":
        raise RunError(f"{name}: {t.cause}; expected a scenario that walks to its end")
    last = len(t) - 1
    return run, t, np.linspace(last - round(2.0 / t.tick), last, STARTS).astype(int)


def short(run: Run, t: Trajectory, rows: np.ndarray) -> np.ndarray:
    """Joint angles and pitch (STARTS, n, 7) [rad] over the horizon from each of a trajectory's rows."""
    s = msgspec.structs.replace(run.scenario, duration=HORIZON, window=Window(), push=(), change=())
    out = []
    for row in rows:
        walked = simulate(run._replace(q=t.q[row].copy(), v=t.v[row].copy(), scenario=s))
        angle = np.full((round(HORIZON / t.tick), 7), math.nan)
        angle[: len(walked)] = walked.q[:, 2:]
        out.append(angle)
    return np.array(out)


def halves(t: Trajectory, start: float) -> list[tuple[float, float]]:
    """Two windows [s] of whole strides after `start`, none if the walk is too short.

    A fraction of a stride more or less changes the mean power by percents. Halves of a walk are nearly independent.
    """
    marks = [float(t.time[row]) for row, leg in strikes(t.phase) if leg == 0 and t.time[row] >= start]
    if t.end != "completed" or len(marks) < 3:
        return []
    middle = marks[len(marks) // 2]
    return [(marks[0], middle), (middle, marks[-1])]


def steady(name: str, changes: Sequence[str]) -> dict[str, Any]:
    """Means and 95 % half-widths over walks of a setting, and its CPU time per second of walking."""
    plan = plan_of(name, [*changes, *WALKS])
    rows: list[dict[str, Any]] = []
    clock, fell = [], 0
    for index in range(len(plan)):
        before = time.process_time()
        trajectory, row = run_one(plan, index)
        clock.append((time.process_time() - before) / row["time"])
        fell += row["fell"]
        rows += [measure(trajectory, window) for window in halves(trajectory, plan.scenario.interval[0])]
    if len(rows) < 2:
        raise RunError(f"{name} with {', '.join(changes)}: {fell} of {len(plan)} walks fell; no steady gait to measure")
    out: dict[str, Any] = {"cpu_per_second": float(np.median(clock)), "fell": fell}
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
    _, trajectory, rows = starts(name, ["duration=12.0", "window.start=6.0", "window.end=12.0"])
    fine = short(plan_of(name, REFERENCE).run(0), trajectory, rows)
    converged = steady(name, CONVERGED)
    table = []
    for case in cases() if chosen is None else chosen:
        error = np.abs(short(plan_of(name, case.changes).run(0), trajectory, rows) - fine).max(axis=(1, 2))
        row = {"group": case.group, "label": case.label, "settings": list(case.changes)}
        row |= {"error": float(np.median(error)), "error_largest": float(error.max())} | steady(name, case.changes)
        for metric in ("speed", "cost_of_transport"):
            shift = row[metric] / converged[metric] - 1.0
            half = math.hypot(row[f"{metric}_half_width"], converged[f"{metric}_half_width"]) / converged[metric]
            row[f"{metric}_shift"], row[f"{metric}_shift_half_width"] = shift, half
        table.append(row)
    return {
        "scenario": title_of(name),
        "horizon": HORIZON,
        "reference": list(REFERENCE),
        "converged": converged | {"settings": list(CONVERGED)},
        "cases": table,
        "recommended": [recommend(table, level) for level in LEVELS],
    }


def within(row: dict[str, Any], level: float) -> bool:
    """Whether speed and cost of transport, intervals included, are within a level of the converged gait's."""
    return row["fell"] == 0 and all(
        abs(row[f"{metric}_shift"]) + row[f"{metric}_shift_half_width"] <= level
        for metric in ("speed", "cost_of_transport")
    )


def recommend(table: Sequence[dict[str, Any]], level: float) -> dict[str, Any]:
    """The cheapest integrator and step within a level of the converged gait; no label if there is none."""
    good = [row for row in table if row["group"] == "steps" and within(row, level)]
    if not good:
        return {"level": level, "label": None, "settings": []}
    best = min(good, key=lambda row: row["cpu_per_second"])
    return {"level": level, "label": best["label"], "settings": best["settings"]}


def run(name: str = SCENARIO, json: bool = False, out: Path | None = None) -> dict[str, Any]:
    """Measures, prints as a table or as one JSON object, and draws walking.png in `out` if one is given."""
    result = compare(name)
    if out is not None:
        from biped.figures.walking import plot_walking

        plot_walking(result, out)
    if json:
        from biped.results import dumps

        print(dumps(result))
    else:
        _show(result)
    return result


def _show(result: dict[str, Any]) -> None:
    from rich.table import Table

    from biped.terminal import console

    table = Table(box=None, pad_edge=False, header_style="dim")
    for head in ("setting", "CPU s/s", "error [rad]", "speed", "cost of transport", "depth [mm]", "slip", "fell"):
        table.add_column(head, justify="left" if head == "setting" else "right", no_wrap=True)
    for row in result["cases"]:
        table.add_row(
            row["label"], f"{row['cpu_per_second']:.4f}", f"{row['error']:.1e}", _percent(row, "speed"),
            _percent(row, "cost_of_transport"), f"{1e3 * row['penetration']:.2f}", f"{row['slip']:.4f}",
            str(row["fell"]),
        )  # fmt: skip
    page = console()
    page.print(f"[bold]{result['scenario']}[/bold]: error after {result['horizon']:g} s against RK4 at 1/64 ms (median "
               "of starts); steady gait against RK4 at 1/8 ms with 95 % half-width")  # fmt: skip
    page.print(table)
    for best in result["recommended"]:
        page.print(f"  cheapest within {best['level']:.1%}: [bold]{best['label'] or 'none of these'}[/bold]")


def _percent(row: dict[str, Any], metric: str) -> str:
    return f"{100.0 * row[f'{metric}_shift']:+.2f} ± {100.0 * row[f'{metric}_shift_half_width']:.2f} %"
