"""What adaptive steps reach against what they were asked for."""

from __future__ import annotations

from collections.abc import Sequence

from biped.show.terminal import console, table
from biped.studies.bench.tolerances import Reached, slope


def show(reached: Sequence[Reached]) -> None:
    """Prints the error over the tolerance of every run, and the slope of every problem."""
    tolerances = list(dict.fromkeys(r.tolerance for r in reached))
    rows = table(("problem", *(f"{t:g}" for t in tolerances), "slope"), ("problem",), no_wrap=True)
    for problem in dict.fromkeys(r.problem for r in reached):
        runs = {r.tolerance: r for r in reached if r.problem == problem}
        cells = ["error" if (e := runs[t].error) is None else _short(e / t) for t in tolerances]
        rows.add_row(problem, *cells, f"{slope(list(runs.values())):.2f}")
    page = console()
    page.print("[bold]largest error, in units of the tolerance[/bold]")
    page.print(rows)
    for r in reached:
        if r.error is None:
            page.print(f"  {r.problem}, {r.tolerance:g}: {r.note}")


def _short(times: float) -> str:
    return f"{times:.2g}" if times < 100 else f"{times:.0f}"
