"""Comparisons as documents: thesis, engines, gaits and laws in columns; walkers over each other; why engines differ."""

import math
from collections.abc import Sequence
from pathlib import Path

from biped.base.errors import echo, short
from biped.base.writing import dumps, write_into
from biped.measure.metrics.walking import outcome
from biped.scenario.engines import MUJOCO
from biped.scenario.metrics import HEAD, METRICS, Metric, metrics_of_table
from biped.show.document import Block, Document, Heading, Items, Kind, Line, Paragraph, Table, Words, markdown
from biped.show.results import failures
from biped.studies.causes import EXPLAINED, Why
from biped.studies.comparison import PARTED, Comparison
from biped.studies.diff import Difference
from biped.studies.diff.changes import BETTER, CHANGED, LEAST_PAIRS, LEVEL, SAME, UNSAID, WORSE, MetricChange

HEADS = ("metric", "first", "second", "change", "95 % interval", "pairs", "verdict")
_KIND: dict[str, Kind] = {WORSE: "bad", BETTER: "good", UNSAID: "doubt"}
_ORDER = (WORSE, BETTER, UNSAID, CHANGED, SAME)
MOST_SETTINGS = 12
"""Settings that differ and are shown; all are in diff.json."""


def difference_document(found: Difference) -> Document:
    """A difference as a document: the verdict, every metric, and which run to look at."""
    verdict = Words(headline(found), "bad" if found.worse else "strong")
    rows = tuple((*cells(change), Words(change.verdict, _KIND.get(change.verdict, ""))) for change in listed(found))
    blocks: list[Block] = [
        Heading(f"{found.first.name} → {found.second.name}", 1), Paragraph(verdict), Items(tuple(remarks(found))),
        Table(HEADS, rows, (0, len(HEADS) - 1)),
    ]  # fmt: skip
    if found.points:
        keys = list(found.points[0].values)
        points = tuple(
            (*(echo(p.values[key]) for key in keys), str(p.pairs), str(p.first), str(p.second)) for p in found.points
        )
        blocks += [Paragraph("Walked, point by point:"), Table((*keys, "pairs", "first", "second"), points, ())]
    return (*blocks, *notes_of(found.margin))


def headline(found: Difference) -> str:
    """The verdict in one line."""
    if found.identical:
        return f"the same to the last digit in all {len(found.pairs)} pairs of runs"
    words = ", ".join(f"{change.name.replace('_', ' ')} {change.verdict}" for change in found.deciding)
    return f"{'WORSE' if found.worse else 'not worse'}: {words}"


def remarks(found: Difference) -> list[str]:
    """Further remarks, a line each."""
    first, second = found.first, found.second
    lines = [
        f"first: {first.name}, {len(first.runs)} runs of {first.result['scenario']} in {first.result['engine']}",
        f"second: {second.name}, {len(second.runs)} runs of {second.result['scenario']} in {second.result['engine']}",
    ]
    if found.decision is not None:
        lines.append(found.decision.words)
    alone = len(first.runs) + len(second.runs) - 2 * len(found.pairs)
    if alone:
        lines.append(f"{alone} runs have no partner of the same seed at the same point: they are left out")
    if len(found.pairs) < LEAST_PAIRS and not found.identical:
        lines.append(
            f"{len(found.pairs)} pairs say nothing about chance, {LEAST_PAIRS} do of means and six that disagree of "
            "counts: --set randomise.runs=50 with --set start.jitter=0.002"
        )
    if found.lost:
        runs = ", ".join(str(run["index"]) for run in found.lost[:10])
        lines.append(f"{len(found.lost)} that walked no longer do: run {runs}{' …' if len(found.lost) > 10 else ''}")
    worst = found.worst_as_dict()
    if worst is not None and not found.identical:
        lines.append(f"to look at: run {worst['index']} of the second ({worst['outcome']}): {worst['again']} --record")
    for key, a, b in found.settings[:MOST_SETTINGS]:
        lines.append(f"{key}: {_value(a)} → {_value(b)}")
    if len(found.settings) > MOST_SETTINGS:
        lines.append(f"… and {len(found.settings) - MOST_SETTINGS} more settings that differ")
    return lines


def listed(found: Difference) -> list[MetricChange]:
    """The metrics with a value, those that matter first."""
    return ordered(found.changes, found.headline)


def ordered(changes: Sequence[MetricChange], headline: Sequence[str]) -> list[MetricChange]:
    """Of changes those of metrics with a value: the headline in its order, then those that matter first."""
    there = {change.name: change for change in changes if change.pairs}
    deciding = [there.pop(name) for name in headline if name in there]
    return [*deciding, *sorted(there.values(), key=lambda change: _ORDER.index(change.verdict))]


def cells(change: MetricChange) -> tuple[str, ...]:
    """A metric's row of `HEADS` up to the verdict."""
    metric, e = change.metric, change.estimate
    head = f"{change.name} [{metric.unit}]" if metric.unit else change.name
    if metric.kind == "count":
        span = "–" if math.isnan(e.low) else f"{_points(e.low)} … {_points(e.high)}"
        return head, str(int(change.first)), str(int(change.second)), _points(e.change), span, str(change.pairs)
    percent = change.first != 0.0 and abs(e.change) < 10.0 * abs(change.first)
    scale = abs(change.first) / 100.0 if percent else 1.0
    unit = " %" if percent else ""

    def relative(value: float) -> str:
        return "–" if math.isnan(value) else f"{value / scale:+.3g}{unit}"

    span = "–" if math.isnan(e.low) else f"{relative(e.low)} … {relative(e.high)}"
    return head, metric.text(change.first), metric.text(change.second), relative(e.change), span, str(change.pairs)


def notes_of(margin: float) -> list[Paragraph]:
    """How to read verdicts with a margin (`biped.studies.diff.changes.MARGIN`)."""
    line = (
        "Counts: McNemar's exact test and Newcombe's interval, in points of the runs. Means: over the pairs that both "
        "walked, Student's paired test and interval, of the first's mean. ", Words("Same", "emphasis"),
        f": the interval lies within ±{margin:.0%}. ", Words("Better", "emphasis"), " and ", Words("worse", "emphasis"),
        ": beyond that. The first rows, the headline, alone decide; by Holm's correction even one verdict among them "
        f"is chance in less than {LEVEL:.0%} of comparisons, and likewise of the other metrics, a family of their "
        "own. ", Words("Changed", "emphasis"), ": likewise, where neither more nor less is better. ",
        Words("Cannot say", "emphasis"), ": anything else; more runs would.",
    )  # fmt: skip
    return [Paragraph(line, note=True)]


def write(found: Difference, folder: Path) -> None:
    """Writes diff.json and diff.md.

    Args:
        found: What to write.
        folder: Where; made if it does not exist.

    Raises:
        InputError: They cannot be written.
    """
    write_into(folder, {"diff.json": dumps(found.as_dict(), indent=1), "diff.md": markdown(difference_document(found))})


def _points(share: float) -> str:
    return f"{100.0 * share:+.3g} pt"


def _value(value: object) -> str:
    return "–" if value is None else short(echo(value), 60)


_SHORT = (*HEAD, "step_length", "step_frequency")


def comparison_document(comparisons: Sequence[Comparison]) -> Document:
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
    return outcome(runs[0]) + (f"; warnings {runs[0]['warnings']}" if runs[0]["warnings"] else "")


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
