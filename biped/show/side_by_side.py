"""Comparisons on a terminal: the thesis, home and MuJoCo in three columns."""

from __future__ import annotations

import math
from collections.abc import Sequence

from biped.measure.metrics import NAMES
from biped.show.terminal import console, number, table
from biped.studies.comparison import ENGINES, PARTED, Comparison, parted_at

_ALL = (
    "walked", "speed", "speed_std", "cost_of_transport", "cost_of_transport_absolute", "cost_of_transport_positive",
    "double_support", "flight", "step_length", "step_frequency", "torso_lean", "mean_torque", "peak_torque",
    "peak_force", "support", "slip", "penetration", "clearance", "switches", "constraint_switches", "contact_loss",
    "energy_residual",
)  # fmt: skip
_SHORT = ("speed", "cost_of_transport", "double_support", "step_length", "step_frequency")


def show(comparisons: Sequence[Comparison]) -> None:
    """Prints one scenario in full, several in one short table."""
    out = console()
    short = len(comparisons) > 1
    page = table(("scenario", "metric", "thesis", "home", "MuJoCo", "gap"), ("scenario", "metric"))
    page.add_column("meaning", overflow="fold")
    for c in comparisons:
        out.print(f"[bold]{c.scenario}[/bold]: {c.description}")
        for engine in ENGINES:
            out.print(f"  {engine:<7} {_ending(c, engine)}")
        at = parted_at(*(c.first[engine] for engine in ENGINES))
        when = f"parted after {at:.2f} s" if math.isfinite(at) else "together to the end"
        out.print(f"  {when} (a coordinate differs by {PARTED} m or rad)")
        metrics = c.metrics()
        for i, name in enumerate(_SHORT if short else _ALL):
            row = metrics[name]
            thesis = number(row["thesis"]) if "thesis" in row else ""
            gap = f"{row['gap']:+.1%}" if math.isfinite(row["gap"]) else "–"
            title = c.scenario if short and i == 0 else ""
            page.add_row(title, name, thesis, number(row["home"]), number(row["mujoco"]), gap, NAMES[name])
    out.print(page)


def _ending(c: Comparison, engine: str) -> str:
    runs = c.results[engine]["runs"]
    if len(runs) > 1:
        summary = c.results[engine]["summary"]
        return f"walked {summary['walked']} of {len(runs)}, fell {summary['falls']}"
    text = "stayed up" if runs[0]["end"] == "completed" else runs[0]["cause"]
    return text + (f"; engine warnings {runs[0]['warnings']}" if runs[0]["warnings"] else "")
