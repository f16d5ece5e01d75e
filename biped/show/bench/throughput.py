"""The time that a control tick, a run and every feature of a scene cost."""

from __future__ import annotations

from biped.show.results import number
from biped.show.terminal import console, table
from biped.studies.bench.throughput import Throughput


def show(measured: Throughput) -> None:
    """Prints one block per part."""
    out = console()
    units = {
        "tick": "µs a tick (ratios without unit)",
        "home": "µs a tick of the home engine",
        "contacts": "µs of mj_step by points on the ground",
        "campaign": "s of CPU, their ratio to as many bare steps, s by the clock",
        "cold_start": "s of CPU",
    }
    out.print(f"[bold]loop[/bold] {measured.loop}")
    for part, unit in units.items():
        out.print(f"[bold]{part}[/bold] [dim]{unit}[/dim]")
        for key, value in getattr(measured, part).items():
            out.print(f"  {key!s:<36}{number(value)}")
    for title, column, costs in (("scenes", "scene", measured.scenes), ("robots of any kind", "run", measured.robots)):
        if costs is None:
            continue
        out.print(f"[bold]{title}[/bold] [dim]µs a tick, and ratios; strict: to steps in compiled code[/dim]")
        words = (column, "ticks are looped over")
        page = table((column, "physics", "steps", "loop", "metrics", "x physics", "x steps", words[1]), words)
        for name, cost in costs.items():
            keys = ("physics", "steps", "closed_loop", "metrics", "with_metrics", "strict")
            page.add_row(name, *(number(cost[key]) for key in keys), cost["loop"])
        out.print(page)
    if measured.features is not None:
        out.print("[bold]features[/bold] [dim]of a scene, each in a process of its own[/dim]")
        words = ("feature", "what only it imports")
        page = table((words[0], "µs a tick", "x mj_step", "MB", words[1]), words)
        for name, price in measured.features.items():
            cells = [number(price[key]) for key in ("tick", "ratio", "memory")]
            page.add_row(name, *cells, ", ".join(price["only_imported"]))
        out.print(page)
