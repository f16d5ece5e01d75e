"""Comparisons: the thesis and every engine in columns; one walker as a ghost over another; why engines differ."""

import math
from collections.abc import Sequence
from pathlib import Path

from biped.measure.metrics.walking import outcome
from biped.scenario.engines import MUJOCO
from biped.scenario.metrics import HEAD, METRICS, Metric, metrics_of_table
from biped.show.document import Block, Document, Heading, Items, Line, Paragraph, Table, Words
from biped.show.results import failures
from biped.studies.causes import EXPLAINED, Why
from biped.studies.comparison import PARTED, Comparison

_SHORT = (*HEAD, "step_length", "step_frequency")


def document_of(comparisons: Sequence[Comparison]) -> Document:
    """One scenario in full, several in one short table."""
    short = len(comparisons) > 1
    engines = comparisons[0].engines
    blocks: list[Block] = []
    rows: list[tuple[Line, ...]] = []
    for c in comparisons:
        lines = [f"{engine}: {_ending(c, engine)}" for engine in engines]
        for (a, b), at in c.parted().items():
            when = f"parted after {at:.2f} s" if math.isfinite(at) else "together to the end"
            lines.append(f"{a} and {b}: {when} (base or legs differ by {PARTED} m)")
        blocks += [
            Heading(f"{c.scenario}: {c.description}"),
            Items(tuple(lines)),
            Paragraph(Words(c.verdict(), "strong")),
        ]
        metrics = c.metrics()
        for i, metric in enumerate([METRICS[name] for name in _SHORT] if short else metrics_of_table("engines")):
            row = metrics[metric.name]
            thesis = metric.text(row["thesis"]) if "thesis" in row else ""
            spread = f"{row['spread']:.1%}" if math.isfinite(row["spread"]) else "–"
            title = c.scenario if short and i == 0 else ""
            values = (with_interval(metric, row[engine], row["intervals"].get(engine)) for engine in engines)
            rows.append((title, metric.name, thesis, *values, spread, metric.explained))
    heads = ("scenario", "metric", "thesis", *map(name_of, engines), "spread", "meaning")
    return *blocks, Table(heads, tuple(rows), (0, 1, len(heads) - 1))


def name_of(engine: str) -> str:
    """The name of an engine for people."""
    return {"mujoco": "MuJoCo", "drake": "Drake"}.get(engine, engine)


def with_interval(metric: Metric, value: float | None, interval: Sequence[float] | None) -> str:
    """A metric's value, with half of its interval where it has one."""
    if interval is None or metric.kind == "count":
        return metric.text(value)
    return f"{metric.text(value)} ± {metric.text(0.5 * (interval[1] - interval[0]))}"


def _ending(c: Comparison, engine: str) -> str:
    runs = c.results[engine]["runs"]
    if len(runs) > 1:
        summary = c.results[engine]["summary"]
        return f"walked {summary['walked']} of {len(runs)}, {failures(summary)}"
    return outcome(runs[0]) + (f"; engine warnings {runs[0]['warnings']}" if runs[0]["warnings"] else "")


def draw(comparison: Comparison, folder: Path) -> None:
    """Writes the overlay, the first strike, and a recording of one engine's walker with the others' as ghosts over it.

    That one is MuJoCo's where there is one.

    Args:
        comparison: What to draw.
        folder: Where; it exists.

    Raises:
        InputError: A file cannot be written.
    """
    from biped.scenario.reading import to_toml
    from biped.show.figures import plot_together
    from biped.show.recording import Recorded, record

    plot_together(comparison.first, folder, comparison.scenario)
    solid = MUJOCO if MUJOCO in comparison.engines else comparison.engines[0]
    ghosts = [engine for engine in comparison.engines if engine != solid]
    recorded = []
    for engine in (solid, *ghosts):
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
                ghost=engine != solid,
            )
        )
    shadows = " and ".join(map(name_of, ghosts))
    title = f"{comparison.scenario}: {name_of(solid)}, and {shadows} as {'ghosts' if len(ghosts) > 1 else 'a ghost'}"
    record(folder / "recording.rrd", recorded, title=title)


def causes_document(found: Why) -> Document:
    """The causes as a document: the verdict, and every cause at its best setting.

    Args:
        found: Of one engine against another, or of two settings of one.
    """
    named = found.named
    rows = tuple(
        (
            Words(one.cause, "strong" if one.cause in named else ""), one.setting, f"{100.0 * one.explained:.1f} %",
            "–" if math.isnan(one.parted_at) else f"{one.parted_at:.2f}",
        )
        for one in found.tried
    )  # fmt: skip
    note = (f"Each cause by itself, in {found.moved}, until it behaves like {found.towards}; named are those that take "
            f"away at least {100 * EXPLAINED:.0f} % of where base and legs differ, moment by moment.")  # fmt: skip
    return (
        Heading(f"{found.scenario}: why {found.moved} differs from {found.towards}"),
        Paragraph(Words(found.verdict(), "strong")),
        Table(("cause", "best setting", "explains", "1 cm apart at [s]"), rows, (0, 1)),
        Paragraph(note, note=True),
    )
