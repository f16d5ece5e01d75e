"""Run time against error of mechanisms: ours and what a user would pick instead."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.table import Table

from biped.studies.bench.mechanisms import Report
from biped.studies.bench.problems import CHAIN, FOUR_BARS


def show(report: Report) -> None:
    """Prints every run and the ratios to peers."""
    console = Console()
    for problem in dict.fromkeys(p.problem for p in report.points):
        table = Table("method", title=problem)
        for column in ("step or tolerance", "largest error", "CPU [ms]", "note"):
            table.add_column(column, justify="left" if column == "note" else "right")
        for p in report.points:
            if p.problem == problem:
                error = "-" if p.error is None else f"{p.error:.2g}"
                cpu = "-" if p.cpu is None else f"{1e3 * p.cpu:.2f}"
                table.add_row(p.method, f"{p.setting:g}", error, cpu, p.note)
        console.print(table)
    for problem, found in ((FOUR_BARS, report.ratios), (CHAIN, report.large)):
        for name, (least, most) in found.items():
            console.print(f"{name}: {least:.3g} to {most:.3g} times our CPU time at equal error ({problem})")
    for name, why in report.skipped.items():
        console.print(f"{name}: skipped, {why}")


def draw(report: Report, folder: Path) -> None:
    """Draws the work-precision figures and chapter II's into a folder; it is made if need be."""
    from biped.show.figures import chapter2, work_precision

    folder.mkdir(parents=True, exist_ok=True)
    work_precision.draw(report.points, folder)
    chapter2.draw(folder)
