"""Results of benchmarks as documents: costs of a tick, a walk and a campaign; timed scenarios beside their record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from biped.show.document import Block, Document, Heading, Items, Kind, Line, Paragraph, Table, Words
from biped.show.results import number

if TYPE_CHECKING:
    from biped.studies.bench.campaigns import CampaignCost
    from biped.studies.bench.engines import StepCost
    from biped.studies.bench.policy import PolicyCost
    from biped.studies.bench.regress import Guarded
    from biped.studies.bench.throughput import Throughput


def throughput_document(measured: Throughput) -> Document:
    """One block per part."""
    units = {
        "tick": "µs a tick (ratios without unit)",
        "home": "µs a tick of the home engine",
        "contacts": "µs of mj_step by points on the ground",
        "campaign": "s of CPU, their ratio to as many bare steps, s by the clock",
        "cold_start": "s of CPU",
    }
    blocks: list[Block] = [Heading(f"loop: {measured.loop}")]
    for part, unit in units.items():
        costs = getattr(measured, part).items()
        blocks.append(Table((part, unit), tuple((str(key), number(value)) for key, value in costs)))
    for title, column, costs in (("scenes", "scene", measured.scenes), ("robots of any kind", "run", measured.robots)):
        if costs is not None:
            blocks += costs_document(title, column, costs)
    if measured.features is not None:
        rows = tuple(
            (name, *(number(price[key]) for key in ("tick", "ratio", "memory")), ", ".join(price["only_imported"]))
            for name, price in measured.features.items()
        )
        blocks.append(Heading("features of a scene, each in a process of its own"))
        blocks.append(Table(("feature", "µs a tick", "x mj_step", "MB", "what only it imports"), rows, (0, 4)))
    return tuple(blocks)


def costs_document(title: str, column: str, costs: Mapping[str, Mapping[str, Any]]) -> Document:
    """Prices of runs beside those of bare steps."""
    heads = (column, "physics", "steps", "loop", "metrics", "x physics", "x steps", "ticks are looped over")
    keys = ("physics", "steps", "closed_loop", "metrics", "with_metrics", "strict")
    rows = tuple((name, *(number(cost[key]) for key in keys), cost["loop"]) for name, cost in costs.items())
    return (
        Heading(f"{title}: µs a tick, and ratios; strict: to steps in compiled code"),
        Table(heads, rows, (0, len(heads) - 1)),
    )


def walking_document(result: Mapping[str, Any]) -> Document:
    """Every setting with its errors and its cost, and the recommendations."""
    heads = ("setting", "CPU s/s", "error [rad]", "speed", "cost of transport", "lost [J/step]", "depth [mm]", "slip",
             "fell")  # fmt: skip
    rows = tuple(
        (row["label"], f"{row['cpu_per_second']:.4f}", f"{row['error']:.1e}", _percent(row, "speed"),
         _percent(row, "cost_of_transport"), f"{row['loss_per_step']:.2f}", f"{1e3 * row['penetration']:.2f}",
         f"{row['slip']:.4f}", str(row["fell"]))
        for row in result["cases"]
    )  # fmt: skip
    best: list[Line] = [
        (f"{one['engine']}, cheapest within {one['level']:.1%}: ", Words(one["label"] or "none of these", "strong"))
        for one in result["recommended"]
    ]
    words = (f"error after {result['horizon']:g} s against steps of 1/64 ms (median of starts); steady gait against "
             "1/8 ms with 95 % half-width; MuJoCo's by RK4")  # fmt: skip
    return Heading(result["scenario"]), Paragraph(words), Table(heads, rows), Items(tuple(best))


def _percent(row: Mapping[str, Any], metric: str) -> str:
    return f"{100.0 * row[f'{metric}_shift']:+.2f} ± {100.0 * row[f'{metric}_shift_half_width']:.2f} %"


def campaigns_document(costs: Sequence[CampaignCost]) -> Document:
    """The clock's times of processes here and of a cluster, and their ratios."""
    heads = ("runs", "of [s]", "here", "cluster", "cluster / here", "here / CPU of runs over cores",
             "parent [ms a run]", "rows")  # fmt: skip
    rows = tuple(
        (f"{cost.runs}", f"{cost.duration:g}", f"{cost.here:.1f}", f"{cost.cluster:.1f}",
         f"{cost.cluster / cost.here:.3f}", f"{cost.here / cost.work:.3f}", f"{cost.parent:.4f}",
         "the same bytes" if cost.same else Words("DIFFERENT", "bad"))
        for cost in costs
    )  # fmt: skip
    title = "Campaigns, seconds by the clock: processes here; a cluster here with as many workers"
    return Heading(title), Table(heads, rows, (len(heads) - 1,))


def regress_document(guarded: Guarded) -> Document:
    """One line per scenario."""
    from biped.studies.bench.regress import ELSEWHERE, SAME, SLOWER

    rows = []
    for one in guarded.timed:
        kind: Kind = "good" if one.result in (SAME, ELSEWHERE) else "bad"
        old = (one.old.loop, one.old.metrics) if one.old else (None, None)
        ratios = (f"{new:.2f}" if then is None else f"{then:.2f} → {new:.2f}"
                  for then, new in zip(old, (one.new.loop, one.new.metrics), strict=True))  # fmt: skip
        slower = Words(f"slower by {one.slower:.0%}", "doubt") if one.slower > SLOWER else ""
        rows.append((one.scenario, Words(one.result, kind), *ratios, slower))
    return (Table(("scenario", "result", "closed loop / mj_step", "with metrics", ""), tuple(rows), (0, 1, 2, 3, 4)),)


def policy_document(file: object, cost: PolicyCost) -> Document:
    """Seconds of one core, and ratios to bare steps and network calls."""
    rows = [("bare steps of MuJoCo, from Python", f"{cost.steps:.3f}", ""),
            ("bare calls of the network", f"{cost.network:.3f}", "")]  # fmt: skip
    for name, loop in (("the run", cost.loop), ("the run, logged at the network's calls", cost.sparse)):
        if loop is not None:
            rows.append((name, f"{loop:.3f}", f"{cost.ratio(loop):.2f}"))
    blocks = [Heading(str(file)), Table((f"of {cost.seconds:g} s", "core [s]", "ratio"), tuple(rows))]
    if cost.one is not None and cost.two is not None:
        words = (f"{cost.runs} runs of {cost.seconds:g} s by the clock: {cost.one:.1f} s in one process, "
                 f"{cost.two:.1f} s in two: {cost.two / cost.one:.2f}; of bare steps {cost.bare:.2f}")  # fmt: skip
        blocks.append(Paragraph(words))
    return tuple(blocks)


def engines_document(costs: Mapping[str, StepCost]) -> Document:
    """µs of a step in Drake and in MuJoCo, and their ratios."""
    heads = (
        "a step of",
        "mj_step [µs]",
        "Drake's update [µs]",
        "x mj_step",
        "the engine's step [µs]",
        "x mj_step",
        "MB",
    )
    rows = tuple(
        (kind, f"{cost.mujoco:.1f}", f"{cost.update:.1f}", f"{cost.update / cost.mujoco:.1f}", f"{cost.step:.1f}",
         f"{cost.step / cost.mujoco:.1f}", f"{cost.memory:.0f}")
        for kind, cost in costs.items()
    )  # fmt: skip
    return (Table(heads, rows),)
