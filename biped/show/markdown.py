"""A Markdown report of campaigns: what was run, rates with intervals, thresholds, figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from biped.base.errors import InputError
from biped.ensemble.sweeps import threshold_words
from biped.scenario.keys import Scenario
from biped.scenario.reading import read_scenario
from biped.show.replay import plot_results
from biped.show.terminal import causes_of, number
from biped.studies.run import results_at

_COLUMNS = ("speed", "cost_of_transport", "double_support")


def write_report(folders: Sequence[Path], out: Path, title: str) -> None:
    """Writes a report of results folders, its figures in a folder beside it.

    Args:
        folders: Results folders.
        out: The Markdown file; figures go to a folder of the same name without suffix.
        title: First heading.

    Raises:
        InputError: A folder holds no results, or the report cannot be written.
    """
    parts = [f"# {title}\n"]
    for folder in folders:
        result = results_at(folder)
        scenario = read_scenario(str(folder / "scenario.toml"))
        figures = plot_results(folder, out.with_suffix("") / folder.name)
        parts.append(_section(result, scenario, [figure.relative_to(out.parent) for figure in figures]))
    try:
        out.write_text("\n".join(parts), encoding="utf-8")
    except OSError as error:
        raise InputError(f"--out {out}: cannot be written: {error.strerror}") from None


def _section(result: Mapping[str, Any], scenario: Scenario, figures: Sequence[Path]) -> str:
    runs, summary = result["runs"], result["summary"]
    low, high = summary["walked_interval"]
    starts = "projected onto the ground" if scenario.start.settle else "as printed"
    lines = [
        f"## {result['scenario']}\n",
        f"{scenario.description}.\n",
        f"`biped run {result['scenario']}`: {len(runs)} × {scenario.duration:g} s in {result['engine']}, jitter "
        f"{scenario.start.jitter:g} rad, contacts {scenario.actuation.contacts}, starts {starts}. "
        f"Walked {summary['walked']} of {len(runs)} (95 % interval {low:.0%} – {high:.0%}), fell {summary['falls']}.\n",
    ]
    for cause, count in causes_of(runs):
        lines.append(f"- {count} × {cause}")
    if "points" in result:
        lines.append("\n" + _points(result["points"]))
        for t in result["thresholds"]:
            lines.append(f"- {threshold_words(t)}")
    else:
        lines.append("\n" + _numbers(summary, result["thesis"]))
    for check in result["checks"]:
        mark = "pass" if check["passed"] else "**FAIL**"
        lines.append(f"- {mark}: {check['name']} = {number(check['value'])}, expected {check['expected']}")
    lines += ["", *(f"![{figure.stem}]({figure.as_posix()})" for figure in figures), ""]
    return "\n".join(lines)


def _points(points: Sequence[Mapping[str, Any]]) -> str:
    keys = list(points[0]["values"])
    head = [
        *(f"`{key}`" for key in keys),
        "walked",
        "95 % interval",
        "fell",
        *(name.replace("_", " ") for name in _COLUMNS),
    ]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for p in points:
        low, high = p["interval"]
        cells = [
            *(number(p["values"][key]) for key in keys), f"{p['walked']}/{p['runs']}", f"{low:.0%} – {high:.0%}",
            str(p["falls"]), *(number(_real(p[name])) for name in _COLUMNS),
        ]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _numbers(summary: Mapping[str, Any], thesis: Mapping[str, float]) -> str:
    lines = ["| | here | thesis |", "|---|---|---|"]
    for name in _COLUMNS:
        theirs = number(thesis[name]) if name in thesis else ""
        lines.append(f"| {name.replace('_', ' ')} | {number(_real(summary[name]))} | {theirs} |")
    return "\n".join(lines) + "\n"


def _real(value: float | None) -> float:
    return float("nan") if value is None else value
