"""The overhead of campaigns, as a table."""

from __future__ import annotations

from collections.abc import Sequence

from biped.show.terminal import console, table
from biped.studies.bench.campaigns import CampaignCost


def show(costs: Sequence[CampaignCost]) -> None:
    """Prints the clock's times of processes here and of a cluster, and their ratios."""
    page = console()
    page.print("[bold]Campaigns[/bold], seconds by the clock: processes here; a cluster here with as many workers")
    heads = (
        "runs",
        "of [s]",
        "here",
        "cluster",
        "cluster / here",
        "here / CPU of runs over cores",
        "parent [ms a run]",
    )
    rows = table((*heads, "rows"), ("rows",))
    for cost in costs:
        ratios = f"{cost.cluster / cost.here:.3f}", f"{cost.here / cost.work:.3f}", f"{cost.parent:.4f}"
        same = "the same bytes" if cost.same else "DIFFERENT"
        rows.add_row(f"{cost.runs}", f"{cost.duration:g}", f"{cost.here:.1f}", f"{cost.cluster:.1f}", *ratios, same)
    page.print(rows)
