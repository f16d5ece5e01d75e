"""Tables of the benches on a terminal."""

import math
import sys
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from biped.dynamics.bench.experiments import Experiments
from biped.dynamics.bench.mechanisms import Benchmark
from biped.dynamics.bench.problems import CHAIN, FOUR_BARS
from biped.dynamics.bench.tolerances import AdaptiveRun, slope

_JOINTS = ("hip", "knee", "ankle")


def print_mechanisms(report: Benchmark) -> None:
    """Prints every run and the ratios to peers."""
    page = _console()
    for problem in dict.fromkeys(p.problem for p in report.points):
        page.print(f"[bold]{problem}[/bold]")
        rows = _table(("method", "step or tolerance", "largest error", "CPU [ms]", "note"), ("method", "note"))
        for p in report.points:
            if p.problem == problem:
                error = "-" if p.error is None else f"{p.error:.2g}"
                cpu = "-" if p.cpu is None else f"{1e3 * p.cpu:.2f}"
                rows.add_row(p.method, f"{p.setting:g}", error, cpu, p.note)
        page.print(rows)
    for problem, found in ((FOUR_BARS, report.ratios), (CHAIN, report.large)):
        for name, (least, most) in found.items():
            page.print(f"{name}: {least:.3g} to {most:.3g} times our CPU time at equal error ({problem})")
    for name, why in report.skipped.items():
        page.print(f"{name}: skipped, {why}", markup=False)


def print_tolerances(reached: Sequence[AdaptiveRun]) -> None:
    """Prints the error over the tolerance of every run, and the slope of every problem."""
    tolerances = list(dict.fromkeys(r.tolerance for r in reached))
    rows = _table(("problem", *(f"{t:g}" for t in tolerances), "slope"), ("problem",))
    for problem in dict.fromkeys(r.problem for r in reached):
        runs = {r.tolerance: r for r in reached if r.problem == problem}
        cells = ["error" if (e := runs[t].error) is None else _short(e / t) for t in tolerances]
        rows.add_row(problem, *cells, f"{slope(list(runs.values())):.2f}")
    page = _console()
    page.print("[bold]largest error, in units of the tolerance[/bold]")
    page.print(rows)
    for r in reached:
        if r.error is None:
            page.print(f"  {r.problem}, {r.tolerance:g}: {r.note}")


def print_experiments(report: Experiments) -> None:
    """Prints periods and damping of the free swings, and the responses of the experiment with moving references."""
    page = _console()
    page.print("[bold]Free swing[/bold] (Fig 4.7): small swings of the hip with a straight leg, of the knee with the "
               "thigh held level")  # fmt: skip
    rows = _table(("joint", "gears hip/knee", "period [s]", "damping ratio", "MuJoCo apart [degrees]"),
                  ("joint", "gears hip/knee"))  # fmt: skip
    for swing in report.swings:
        apart = "–" if math.isnan(swing.apart) else f"{swing.apart:.1e}"
        rows.add_row(swing.joint, swing.reading.name, f"{swing.period:.4f}", f"{swing.damping_ratio:.4f}", apart)
    page.print(rows)
    page.print("[bold]Springs with moving references[/bold] (Fig 4.8): amplitude and lag [degrees] at the reference's "
               "frequency")  # fmt: skip
    rows = _table(("joint", "in 10.7 – 14.7 s", "steady", "a linearisation says"), ("joint",))
    followed = report.followed
    for joint, *found in zip(_JOINTS, followed.window, followed.steady, followed.linear, strict=True):
        rows.add_row(joint, *(f"{one.amplitude:.2f}, {one.lag:.1f}" for one in found))
    page.print(rows)
    page.print(f"  MuJoCo apart by at most {followed.apart:.1e} degrees")


def _console() -> Console:
    """The terminal; wide enough for tables when it is a file or a pipe."""
    return Console(width=None if sys.stdout.isatty() else 120)


def _table(columns: Sequence[str], words: Sequence[str]) -> Table:
    """An empty table without lines; columns that hold words go to the left, numbers to the right."""
    out = Table(box=None, pad_edge=False, header_style="dim")
    for column in columns:
        out.add_column(column, justify="left" if column in words else "right", no_wrap=column != "note")
    return out


def _short(times: float) -> str:
    return f"{times:.2g}" if times < 100 else f"{times:.0f}"
