"""Comparisons: the thesis, home and MuJoCo in three columns; one walker as a ghost over the other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from biped.measure.metrics.walking import outcome
from biped.scenario.metrics import HEAD, METRICS, metrics_of_table
from biped.show.results import failures
from biped.show.terminal import console, table
from biped.studies.comparison import ENGINES, PARTED, Comparison, parted_at

_SHORT = (*HEAD, "step_length", "step_frequency")


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
        for i, metric in enumerate([METRICS[name] for name in _SHORT] if short else metrics_of_table("engines")):
            row = metrics[metric.name]
            thesis = metric.text(row["thesis"]) if "thesis" in row else ""
            gap = f"{row['gap']:+.1%}" if math.isfinite(row["gap"]) else "–"
            title = c.scenario if short and i == 0 else ""
            values = (metric.text(row[engine]) for engine in ENGINES)
            page.add_row(title, metric.name, thesis, *values, gap, metric.explained)
    out.print(page)


def _ending(c: Comparison, engine: str) -> str:
    runs = c.results[engine]["runs"]
    if len(runs) > 1:
        summary = c.results[engine]["summary"]
        return f"walked {summary['walked']} of {len(runs)}, {failures(summary)}"
    return outcome(runs[0]) + (f"; engine warnings {runs[0]['warnings']}" if runs[0]["warnings"] else "")


def draw(comparison: Comparison, folder: Path) -> None:
    """Writes the overlay figure and a recording in which the home walker is a ghost over MuJoCo's.

    Args:
        comparison: What to draw.
        folder: Where; it exists.

    Raises:
        InputError: A file cannot be written.
    """
    from biped.scenario.reading import to_toml
    from biped.show.figures import plot_overlay
    from biped.show.recording import Recorded, record

    plot_overlay(comparison.first, folder / "overlay.png", comparison.scenario)
    recorded = []
    for engine in ("mujoco", "home"):
        plan, result = comparison.plans[engine], comparison.results[engine]
        recorded.append(
            Recorded(
                name=engine,
                title=f"{comparison.scenario} in {engine}",
                trajectory=comparison.first[engine],
                model=plan.visual_model,
                metrics=result["runs"][0],
                checks=[dict(check) for check in result["checks"]],
                scenario_text=to_toml(plan.scenario),
                ghost=engine == "home",
            )
        )
    record(folder / "recording.rrd", recorded, title=f"{comparison.scenario}: MuJoCo, and home as a ghost")
