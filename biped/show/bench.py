"""Results of benchmarks as tables: costs of a tick, a walk and a campaign, and timed scenarios beside their record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from biped.base.text import plain
from biped.show.results import number
from biped.show.terminal import console, table

if TYPE_CHECKING:
    from biped.studies.bench.campaigns import CampaignCost
    from biped.studies.bench.engines import StepCost
    from biped.studies.bench.policy import PolicyCost
    from biped.studies.bench.regress import Guarded
    from biped.studies.bench.throughput import Throughput


def show_throughput(measured: Throughput) -> None:
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


def show_walking(result: Mapping[str, Any]) -> None:
    """Prints every setting with its errors and its cost, and the recommendations."""
    heads = ("setting", "CPU s/s", "error [rad]", "speed", "cost of transport", "lost [J/step]", "depth [mm]", "slip",
             "fell")  # fmt: skip
    rows = table(heads, ("setting",), no_wrap=True)
    for row in result["cases"]:
        rows.add_row(
            row["label"], f"{row['cpu_per_second']:.4f}", f"{row['error']:.1e}", _percent(row, "speed"),
            _percent(row, "cost_of_transport"), f"{row['loss_per_step']:.2f}", f"{1e3 * row['penetration']:.2f}",
            f"{row['slip']:.4f}", str(row["fell"]),
        )  # fmt: skip
    page = console()
    page.print(f"[bold]{result['scenario']}[/bold]: error after {result['horizon']:g} s against steps of 1/64 ms "
               "(median of starts); steady gait against 1/8 ms with 95 % half-width; MuJoCo's by RK4")  # fmt: skip
    page.print(rows)
    for best in result["recommended"]:
        label = best["label"] or "none of these"
        page.print(f"  {best['engine']}, cheapest within {best['level']:.1%}: [bold]{label}[/bold]")


def _percent(row: Mapping[str, Any], metric: str) -> str:
    return f"{100.0 * row[f'{metric}_shift']:+.2f} ± {100.0 * row[f'{metric}_shift_half_width']:.2f} %"


def show_campaigns(costs: Sequence[CampaignCost]) -> None:
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


def show_regress(guarded: Guarded) -> None:
    """Prints one line per scenario."""
    from biped.studies.bench.regress import ELSEWHERE, SAME, SLOWER

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


def show_policy(file: object, cost: PolicyCost) -> None:
    """Prints seconds of one core, and ratios to bare steps and network calls."""
    page, rows = console(), table((f"of {cost.seconds:g} s", "core [s]", "ratio"), (f"of {cost.seconds:g} s",))
    page.print(f"[bold]{plain(str(file))}[/bold]")
    rows.add_row("bare steps of MuJoCo, from Python", f"{cost.steps:.3f}", "")
    rows.add_row("bare calls of the network", f"{cost.network:.3f}", "")
    for name, loop in (("the run", cost.loop), ("the run, logged at the network's calls", cost.sparse)):
        if loop is None:
            continue
        rows.add_row(name, f"{loop:.3f}", f"{cost.ratio(loop):.2f}")
    page.print(rows)
    if cost.one is not None and cost.two is not None:
        page.print(f"  {cost.runs} runs of {cost.seconds:g} s by the clock: {cost.one:.1f} s in one process, "
                   f"{cost.two:.1f} s in two: {cost.two / cost.one:.2f}; of bare steps {cost.bare:.2f}")  # fmt: skip


def show_engines(costs: Mapping[str, StepCost]) -> None:
    """Prints µs of a step in Drake and in MuJoCo, and their ratios."""
    heads = (
        "a step of",
        "mj_step [µs]",
        "Drake's update [µs]",
        "x mj_step",
        "the engine's step [µs]",
        "x mj_step",
        "MB",
    )
    rows = table(heads, heads[:1])
    for kind, cost in costs.items():
        ratios = f"{cost.update / cost.mujoco:.1f}", f"{cost.step / cost.mujoco:.1f}"
        rows.add_row(kind, f"{cost.mujoco:.1f}", f"{cost.update:.1f}", ratios[0], f"{cost.step:.1f}", ratios[1],
                     f"{cost.memory:.0f}")  # fmt: skip
    console().print(rows)
