"""A Markdown report of campaigns: what was run, rates with intervals, thresholds, figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.base.replacing import Kind, may_add, may_write
from biped.base.writing import reason, write_text
from biped.ensemble.checks import NOTHING, PASSED, sentence_of, word_of
from biped.ensemble.guard import numbered
from biped.ensemble.plan import Plan
from biped.ensemble.sweeps import threshold_words
from biped.scenario.keys import Scenario
from biped.scenario.laws import own_law
from biped.scenario.metrics import HEAD, METRICS
from biped.scenario.reading import read_scenario
from biped.scenario.vary import points_of
from biped.show.replay import plot_results
from biped.show.terminal import NOWHERE, causes_of, failures, nowhere, number
from biped.show.words import harmless, told
from biped.studies.folders import results_at

MARK = "<!-- written by biped report -->"
KIND = Kind("a report of biped", (".md", ".markdown"), (MARK.encode(),))


def write_report(folders: Sequence[Path], out: Path, title: str) -> None:
    """Writes a report of results folders, its figures in a folder beside it.

    Args:
        folders: Results folders.
        out: The Markdown file; figures go to a folder of the same name without suffix.
        title: First heading.

    Raises:
        InputError: A folder holds no results, the report cannot be written, or something else is there.
    """
    may_write(out, "--out", KIND)
    parts = [f"# {told(title)}\n"]
    taken: set[Path] = set()
    for folder in folders:
        result = harmless(results_at(folder))
        scenario = read_scenario(str(folder / "scenario.toml"), looking=True)
        beside = next(path for path in numbered(out.with_suffix(""), folder.resolve().name) if path not in taken)
        taken.add(beside)
        may_add(beside, "--out")
        figures = plot_results(folder, beside)
        drawn = [figure.relative_to(out.parent) for figure in figures]
        parts.append(_section(result, scenario, _command(folder, result, scenario), drawn))
    try:
        write_text(out, "\n".join([*parts, MARK, ""]))
    except OSError as error:
        raise InputError(f"--out {out}: cannot be written: {reason(error)}") from None


def _command(folder: Path, result: Mapping[str, Any], scenario: Scenario) -> str:
    """The command that repeats a folder's runs: by the scenario's name only if that alone gives the same."""
    try:
        plan = Plan(read_scenario(result["scenario"], looking=True), checked=True)
        name = result["scenario"] if plan.scenario == Plan(scenario, checked=True).scenario else ""
    except InputError:
        name = ""
    runs = result["runs"]
    several = scenario.randomise.runs * len(points_of(scenario)) > 1
    only = f" --only {runs[0]['index']}" if several and len(runs) == 1 else ""
    trust = " --trust" if own_law(scenario.law) else ""
    return f"biped run {name or folder / 'scenario.toml'}{only}{trust}"


def _section(result: Mapping[str, Any], scenario: Scenario, command: str, figures: Sequence[Path]) -> str:
    runs, summary = result["runs"], result["summary"]
    low, high = summary["walked_interval"]
    start, fell = scenario.start, failures(summary)
    starts = "projected onto the ground" if start.settle else "as printed"
    lines = [
        f"## {told(result['scenario'])}\n",
        f"{told(scenario.description)}.\n",
        f"`{_code(command)}`: {len(runs)} × {scenario.duration:g} s in {told(result['engine'])}, jitter "
        f"{start.jitter:g} rad, contacts {scenario.actuation.contacts}, starts {starts}. "
        f"Walked {summary['walked']} of {len(runs)} (95 % interval {low:.0%} – {high:.0%}), {fell}.\n",
    ]
    for cause, count in causes_of(runs):
        lines.append(f"- {count} × {told(cause)}")
    if "points" in result:
        lines.append("\n" + _points(result["points"]))
        for t in result["thresholds"]:
            lines.append(f"- {told(threshold_words(t))}")
    else:
        lines.append("\n" + _numbers(summary, result["thesis"]))
    for check in result["checks"]:
        word = word_of(check)
        mark = word if word == PASSED else f"**{word.upper()}**"
        lines.append(f"- {mark}: {told(sentence_of(check, number(check['value'])))}")
    if not result["checks"]:
        lines.append(f"- {NOTHING}")
    lines += ["", *(f"![{figure.stem}]({figure.as_posix()})" for figure in figures), ""]
    return "\n".join(lines)


def _code(text: str) -> str:
    """Somebody's name between backticks, which it cannot end."""
    return text.replace("`", "'").replace("|", "/")


def _points(points: Sequence[Mapping[str, Any]]) -> str:
    keys = list(points[0]["values"])
    head = [
        *(f"`{_code(key)}`" for key in keys),
        "walked",
        "95 % interval",
        "fell",
        *(METRICS[name].words for name in HEAD),
    ]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for p in points:
        low, high = p["interval"]
        cells = [
            *(told(number(p["values"][key])) for key in keys), f"{p['walked']}/{p['runs']}", f"{low:.0%} – {high:.0%}",
            str(p["falls"]), *(METRICS[name].text(p[name]) for name in HEAD),
        ]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _numbers(summary: Mapping[str, Any], thesis: Mapping[str, float]) -> str:
    lines = ["| | here | thesis |", "|---|---|---|"]
    for name in HEAD:
        metric = METRICS[name]
        unit = f" [{metric.unit}]" if metric.unit else ""
        theirs = metric.text(thesis[name]) if name in thesis else ""
        lines.append(f"| {metric.words}{unit} | {metric.text(summary[name])} | {theirs} |")
    return "\n".join([*lines, *(["", f"({NOWHERE})"] if nowhere(summary) else [])]) + "\n"
