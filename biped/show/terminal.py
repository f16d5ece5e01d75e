"""What people see on a terminal: tables of numbers beside the thesis's, verdicts, progress."""

from __future__ import annotations

import json
import math
import sys
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from biped.ensemble.checks import FAILED, NOTHING, PASSED, UNDECIDED, judgement, sentence_of, word_of
from biped.ensemble.columns import batches
from biped.ensemble.sweeps import threshold_words
from biped.measure.metrics.gait import MOVED
from biped.measure.metrics.walking import TOLD_BY, kind_of, outcome
from biped.scenario.metrics import HEAD, METRICS, shown_in
from biped.show.safe import SafeConsole

STEPS_AFTER = ("first_step", "second_step", "third_step", "fourth_step")
WARNED = 10
"""Most runs whose warnings are printed."""
_MARKS = {PASSED: "[green]passed[/green]", FAILED: "[red]FAILED[/red]", UNDECIDED: "[yellow]undecided[/yellow]",
          NOTHING: NOTHING}  # fmt: skip
NOWHERE = f"no cost of transport, no slip: moved less than {MOVED:g} m in the window"


def console() -> Console:
    """The terminal; plain and wide enough for tables when it is a file or a pipe."""
    return SafeConsole(width=None if sys.stdout.isatty() else 120)


def number(value: Any) -> str:
    """A number for people: three significant digits, a dash if there is none."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return "–" if not math.isfinite(value) else f"{value:.3g}"
    return str(value)


def table(columns: Sequence[str], words: Collection[str] = (), no_wrap: bool = False) -> Table:
    """An empty table without lines.

    Args:
        columns: Heads.
        words: Those that hold words and go to the left; numbers go to the right.
        no_wrap: Whether cells stay in one line.
    """
    out = Table(box=None, pad_edge=False, header_style="dim")
    for column in columns:
        out.add_column(column, justify="left" if column in words else "right", no_wrap=no_wrap)
    return out


def show_result(result: Mapping[str, Any], description: str) -> None:
    """Prints a result: how it ended, its numbers beside the thesis's, and the checks."""
    out = console()
    runs, summary = result["runs"], result["summary"]
    out.print(f"[bold]{result['scenario']}[/bold] in {result['engine']}: {description}")
    if len(runs) == 1:
        run = runs[0]
        out.print(f"  {outcome(run)}; {run['time']:.2f} s, {run['distance']:.2f} m")
        if "leg_states" in run:
            out.print(f"  leg states {run['leg_states']['cycle']} in {run['leg_states']['share']:.0%} of cycles")
    else:
        low, high = summary["walked_interval"]
        out.print(f"  walked {summary['walked']} of {len(runs)} (95 % interval {low:.0%} – {high:.0%}), "
                  f"{failures(summary)}")  # fmt: skip
        for cause, count in causes_of(runs):
            out.print(f"    {count} × {cause}")
    show_warnings(runs)
    if "points" not in result and push_words(summary):  # a sweep's pushes differ
        out.print(f"  {push_words(summary)}")
    thesis = result["thesis"]
    page = table(("metric", "value", *(["thesis"] if thesis else []), "meaning"), ("metric", "meaning"))
    for metric in shown_in("run"):
        theirs = [metric.text(thesis[metric.name]) if metric.name in thesis else ""] if thesis else []
        page.add_row(metric.name, metric.text(summary[metric.name]), *theirs, metric.explained)
    for name, values in signals_of(runs).items():
        page.add_row(name, number(values["mean"]), *([""] if thesis else []),
                     f"the law's own signal: {number(values['min'])} … {number(values['max'])}")  # fmt: skip
    out.print(page)
    if nowhere(summary):
        out.print(f"  {NOWHERE}")
    if "points" in result:
        show_points(result)
    show_checks(result)


def signals_of(runs: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """What a law of the user's own logged: mean, smallest and largest over the runs that have it, by name."""
    told: dict[str, tuple[int, float, float, float]] = {}
    for columns in batches(runs, ("signals",)):
        for logged in columns["signals"]:
            if not isinstance(logged, str | dict):  # nothing was logged
                continue
            for name, one in (json.loads(logged) if isinstance(logged, str) else logged).items():
                if real(one["mean"]):
                    count, total, least, most = told.get(name, (0, 0.0, math.inf, -math.inf))
                    told[name] = count + 1, total + one["mean"], min(least, one["min"]), max(most, one["max"])
    return {
        name: {"mean": total / count, "min": least, "max": most} for name, (count, total, least, most) in told.items()
    }


def push_words(numbers: Mapping[str, Any]) -> str:
    """A push and what came after it, in one line; empty where nobody pushed."""
    if not real(numbers["push_impulse"]):
        return ""
    impulse, speed, share = (number(numbers[name]) for name in ("push_impulse", "push_speed", "push_froude"))
    told = f"pushed with {impulse} N s, {speed} m/s of the whole robot, {share} sqrt(g leg)"
    steps = [numbers[name] for name in STEPS_AFTER if real(numbers[name])]
    if real(numbers["recovery_time"]):
        told += f"; recovered in {number(numbers['recovery_time'])} s"
    return f"{told}; next steps {', '.join(number(step) for step in steps)} m" if steps else told


def show_points(result: Mapping[str, Any]) -> None:
    """Prints the points of a sweep and its thresholds."""
    out = console()
    keys = list(result["points"][0]["values"])
    page = table((*keys, "walked", "95 % interval", *HEAD))
    for point in result["points"]:
        low, high = point["interval"]
        page.add_row(
            *(number(point["values"][key]) for key in keys), f"{point['walked']}/{point['runs']}",
            f"{low:.0%} – {high:.0%}", *(METRICS[name].text(point[name]) for name in HEAD),
        )  # fmt: skip
    out.print(page)
    for t in result["thresholds"]:
        out.print(f"  {threshold_words(t)}")


def show_warnings(runs: Sequence[Mapping[str, Any]]) -> None:
    """Prints which runs the engine warned of: the first few, and how many there are besides."""
    out, more = console(), 0
    for columns in batches(runs, ("index", "warnings")):
        for index, warnings in zip(columns["index"], columns["warnings"], strict=True):
            if warnings not in ({}, "{}"):
                more += 1
                if more <= WARNED:
                    out.print(f"  run {index}: engine warnings {warnings}")
    if more > WARNED:
        out.print(f"  {more - WARNED} more runs with engine warnings")


def causes_of(runs: Sequence[Mapping[str, Any]]) -> list[tuple[str, int]]:
    """What became of the runs that did not walk and how often, the commonest first."""
    causes: Counter[str] = Counter()
    for columns in batches(runs, ("walked", *TOLD_BY)):
        for place in np.flatnonzero(~columns["walked"]):
            causes[kind_of({name: columns[name][place] for name in TOLD_BY})] += 1
    return causes.most_common()


def failures(summary: Mapping[str, Any]) -> str:
    """How many fell, how many of those diverged, and how many runs are doubtful, in words."""
    diverged = f" ({summary['diverged']} of them diverged)" if summary["diverged"] else ""
    doubtful = f", {summary['doubtful']} doubtful" if summary["doubtful"] else ""
    return f"fell {summary['falls']}{diverged}{doubtful}"


def nowhere(summary: Mapping[str, Any]) -> bool:
    """Whether there is a speed, but not the distance that a cost of transport is divided by."""
    return real(summary["speed"]) and not real(summary["cost_of_transport"])


def real(value: float | None) -> bool:
    """Whether a number exists."""
    return value is not None and math.isfinite(value)


def show_verdict(result: Mapping[str, Any], description: str) -> None:
    """Prints whether a scenario is as it expects, and its checks."""
    verdict = _MARKS[judgement(result)]
    console().print(f"[bold]{result['scenario']}[/bold] {verdict}: {description}")
    show_checks(result)


def show_checks(result: Mapping[str, Any]) -> None:
    """Prints one line per check, or that nothing was expected."""
    out = console()
    for check in result["checks"]:
        out.print(f"  {_MARKS[word_of(check)]}  {sentence_of(check, number(check['value']))}")
    if not result["checks"]:
        out.print(f"  {NOTHING}")


@contextmanager
def progress(title: str, total: int, done: int) -> Iterator[Any]:
    """A progress bar on stderr, only if that is a terminal; yields a function to call per finished run."""
    if not sys.stderr.isatty() or total < 2:
        yield lambda *_: None
        return
    from rich import progress as bar

    columns = (
        bar.TextColumn("{task.description}"), bar.BarColumn(), bar.MofNCompleteColumn(),
        bar.TextColumn("{task.fields[rate]}"), bar.TimeRemainingColumn(),
    )  # fmt: skip
    with bar.Progress(*columns, console=SafeConsole(stderr=True), transient=True) as shown:
        task = shown.add_task(title, total=total, completed=done, rate="")

        def advance(count: int = 1, words: str = "") -> None:
            shown.advance(task, count)
            speed = shown.tasks[0].speed
            rate = f"{speed:.1f} runs/s" if speed else ""
            shown.update(task, rate=", ".join(filter(None, (rate, words))))

        yield advance
