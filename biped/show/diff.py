"""A difference of two results for people: on a terminal, and as a page that CI keeps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from biped.base.json import dumps
from biped.base.text import echo, short
from biped.base.writing import write_into
from biped.show.terminal import console, table
from biped.show.words import told
from biped.studies.diff.changes import BETTER, CHANGED, LEAST_PAIRS, LEVEL, SAME, UNSAID, WORSE, MetricChange
from biped.studies.diff.study import Difference

HEADS = ("metric", "first", "second", "change", "95 % interval", "pairs", "verdict")
_COLOUR = {WORSE: "red", BETTER: "green", UNSAID: "yellow"}
_ORDER = (WORSE, BETTER, UNSAID, CHANGED, SAME)
MOST_SETTINGS = 12
"""Settings that differ and are shown; all are in diff.json."""


def show(found: Difference) -> None:
    """Prints the verdict, every metric, and which run to look at."""
    out = console()
    out.print(f"[bold]{_colour(headline(found), found)}[/bold]")
    for line in remarks(found):
        out.print(f"  {line}")
    page = table(HEADS, ("metric", "verdict"))
    for change in shown(found):
        colour = _COLOUR.get(change.verdict)
        verdict = f"[{colour}]{change.verdict}[/{colour}]" if colour else change.verdict
        page.add_row(*cells(change), verdict)
    out.print(page)
    if found.points:
        out.print("  walked, point by point")
        keys = list(found.points[0].values)
        points = table((*keys, "pairs", "first", "second"))
        for point in found.points:
            points.add_row(
                *(echo(point.values[key]) for key in keys), *map(str, (point.pairs, point.first, point.second))
            )
        out.print(points)


def headline(found: Difference) -> str:
    """The verdict in one line."""
    if found.identical:
        return f"the same to the last digit in all {len(found.pairs)} pairs of runs"
    if found.worse:
        return f"WORSE: {', '.join(name.replace('_', ' ') for name in found.worse)}"
    counts = {verdict: sum(c.verdict == verdict for c in found.changes) for verdict in (BETTER, SAME, UNSAID)}
    return "not worse: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)


def remarks(found: Difference) -> list[str]:
    """What else there is to say, a line each."""
    first, second = found.first, found.second
    lines = [
        f"first: {first.name}, {len(first.runs)} runs of {first.result['scenario']} in {first.result['engine']}",
        f"second: {second.name}, {len(second.runs)} runs of {second.result['scenario']} in {second.result['engine']}",
    ]
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


def shown(found: Difference) -> list[MetricChange]:
    """The metrics with a value, those that matter first."""
    return ordered(found.changes)


def ordered(changes: Sequence[MetricChange]) -> list[MetricChange]:
    """Of changes those of metrics with a value, those that matter first."""
    there = [change for change in changes if change.pairs]
    return sorted(there, key=lambda change: _ORDER.index(change.verdict))


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


def markdown(found: Difference) -> str:
    """The page."""
    lines = [f"# {told(found.first.name)} → {told(found.second.name)}", "", f"**{told(headline(found))}**", ""]
    lines += [f"- {told(line)}" for line in remarks(found)]
    lines += ["", *_table(HEADS, [(*cells(change), change.verdict) for change in shown(found)]), ""]
    if found.points:
        keys = list(found.points[0].values)
        rows = [(*(echo(p.values[key]) for key in keys), p.pairs, p.first, p.second) for p in found.points]
        lines += ["Walked, point by point:", "", *_table((*keys, "pairs", "first", "second"), rows), ""]
    lines += [*notes(found), ""]
    return "\n".join(lines)


def notes(found: Difference) -> list[str]:
    """How to read the verdicts."""
    return notes_of(found.margin)


def notes_of(margin: float) -> list[str]:
    """How to read verdicts with a margin (`biped.studies.diff.changes.MARGIN`)."""
    return [
        f"Counts: McNemar's exact test and Newcombe's interval, in points of the runs. Means: over the pairs that both "
        f"walked, Student's paired test and interval, of the first's mean. *Same*: the interval lies within "
        f"±{margin:.0%}. *Better* and *worse*: beyond that, and by Holm's correction all of them together are "
        f"chance in less than {LEVEL:.0%} of comparisons. *Changed*: likewise, where neither more nor less is better. "
        "*Cannot say*: anything else; more runs would."
    ]


def write(found: Difference, folder: Path) -> None:
    """Writes diff.json and diff.md.

    Args:
        found: What to write.
        folder: Where; made if it does not exist.

    Raises:
        InputError: They cannot be written.
    """
    write_into(folder, {"diff.json": dumps(found.as_dict(), indent=1), "diff.md": markdown(found)})


def _table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    lines = ["| " + " | ".join(told(head) for head in heads) + " |", "|" + "---|" * len(heads)]
    return lines + ["| " + " | ".join(told(cell) for cell in row) + " |" for row in rows]


def _points(share: float) -> str:
    return f"{100.0 * share:+.3g} pt"


def _value(value: object) -> str:
    return "–" if value is None else short(echo(value), 60)


def _colour(line: str, found: Difference) -> str:
    return f"[red]{line}[/red]" if found.worse else line
