"""Results and costs of timed scenarios beside what was recorded."""

from __future__ import annotations

from biped.show.terminal import console, table
from biped.studies.bench.regress import ELSEWHERE, SAME, SLOWER, Guarded


def show(guarded: Guarded) -> None:
    """Prints one line per scenario."""
    columns = ("scenario", "result", "closed loop / mj_step", "with metrics", "")
    rows = table(columns, words=columns)
    for one in guarded.timed:
        colour = "green" if one.result in (SAME, ELSEWHERE) else "red"
        rows.add_row(
            one.scenario, f"[{colour}]{one.result}[/{colour}]",
            *(f"{getattr(one.old, part):.2f} → {getattr(one.new, part):.2f}" if one.old else
              f"{getattr(one.new, part):.2f}" for part in ("loop", "metrics")),
            f"[yellow]slower by {one.slower:.0%}[/yellow]" if one.slower > SLOWER else "",
        )  # fmt: skip
    console().print(rows)
