"""The cost of a learned policy's closed loop, as a table."""

from __future__ import annotations

from pathlib import Path

from biped.base.files import label
from biped.base.text import plain
from biped.show.terminal import console, table
from biped.studies.bench.policy import RUNS, PolicyCost


def show(file: Path, cost: PolicyCost) -> None:
    """Prints seconds of one core, and ratios to bare steps and network calls."""
    page, rows = console(), table((f"of {cost.seconds:g} s", "core [s]", "ratio"), (f"of {cost.seconds:g} s",))
    page.print(f"[bold]{plain(label(file))}[/bold]")
    rows.add_row("bare steps of MuJoCo, from Python", f"{cost.steps:.3f}", "")
    rows.add_row("bare calls of the network", f"{cost.network:.3f}", "")
    for name, loop in (("the run", cost.loop), ("the run, logged at the network's calls", cost.sparse)):
        rows.add_row(name, f"{loop:.3f}", f"{cost.ratio(loop):.2f}")
    page.print(rows)
    if cost.one is not None and cost.two is not None:
        page.print(f"  {RUNS} runs of 2 s by the clock: {cost.one:.1f} s in one process, {cost.two:.1f} s in two "
                   f"({cost.two / cost.one:.2f})")  # fmt: skip
