"""The text beside the picture: verdict and five numbers; all numbers; the scenario."""

import re
from collections.abc import Mapping
from typing import Any

import rerun as rr

from biped.base.text import markdown_table, plain
from biped.ensemble.checks import FAILED, NOTHING, PASSED, UNDECIDED, word_of
from biped.measure.metrics.walking import outcome
from biped.measure.pushes import pushes_of
from biped.scenario.metrics import METRICS
from biped.show.recording.recorded import Placed, Recorded
from biped.show.words import literal, value_of, words

FIVE = ("speed", "cost_of_transport", "double_support", "step_length", "peak_torque")
"""Entities that the viewer shows first."""


def log_report(recording: rr.RecordingStream, placed: Placed) -> None:
    """Logs a run's verdict, its numbers and its scenario as Markdown."""
    text = plain_lines(placed.run.scenario_text.strip())
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", text)), default=0))
    for name, page in (
        ("result", result(placed.run)),
        ("numbers", numbers(placed.run)),
        ("scenario", f"{fence}toml\n{text}\n{fence}"),
    ):
        document = rr.TextDocument(page, media_type=rr.MediaType.MARKDOWN)
        recording.log(placed.entity(name), document, static=True)


def result(run: Recorded) -> str:
    """The verdict of a run in Markdown, its expectations, and the five numbers that say most."""
    trajectory = run.trajectory
    distance = trajectory.x[-1] - trajectory.x[0]
    lines = [
        f"## {literal(run.title or run.name)}: {literal(verdict(run))}",
        f"{trajectory.time[-1] + trajectory.tick:.1f} s, {distance:.2f} m",
    ]
    if trajectory.slope:
        lines[-1] += f", slope {trajectory.slope:+g}°"
    if trajectory.generalized:
        lines[-1] += ", generalized forces (no robot can apply them)"
    ground = trajectory.ground
    if not ground.level:
        lines[-1] += f", ground {100 * ground.z.min():+.1f} to {100 * ground.z.max():+.1f} cm high"
    for push in pushes_of(trajectory):
        forward, left, up = push.force[0]
        aside = f"{left:g} N to the left, " if left else ""
        size = f"{forward:g} N forward, {aside}{up:g} N up" if len(push.force) == 1 else push.size
        lines.append(f"- push on the {words(push.body)}: {size}, {push.start:g} to {push.end:g} s")
    if trajectory.warnings:
        lines += [
            "",
            "MuJoCo warned: " + ", ".join(f"{literal(n)} ({k} times)" for n, k in trajectory.warnings.items()),
        ]
    shown = [name for name in FIVE if name in run.metrics]
    if shown:
        rows = ((words(name), _with_unit(name, run.metrics[name])) for name in shown)
        lines += ["", markdown_table(("in the window", ""), rows)]
    if run.checks:
        marks = [word_of(check) for check in run.checks]
        for mark in (FAILED, UNDECIDED):
            names = [words(check["name"]) for check, one in zip(run.checks, marks, strict=True) if one == mark]
            lines += ["", f"**{mark.upper()}**: {', '.join(names)}"] if names else []
        if set(marks) == {PASSED}:
            lines += ["", "**passed**: all expectations met"]
        rows = (
            (words(check["name"]), literal(check["expected"]), literal(value_of(check["value"])),
             one if one == PASSED else f"**{one.upper()}**")
            for check, one in zip(run.checks, marks, strict=True)
        )  # fmt: skip
        lines += ["", markdown_table(("expected", "", "value", ""), rows)]
    else:
        lines += ["", NOTHING]
    return "\n".join(lines)


def verdict(run: Recorded) -> str:
    """How the run ended, in words."""
    if "end" in run.metrics:
        return outcome(run.metrics)
    return run.trajectory.cause or "stayed up to the end"


def numbers(run: Recorded) -> str:
    """Everything that was measured, and what it means, in Markdown; first what was drawn."""
    lines = []
    drawn = {key: run.metrics[key] for key in ("index", "seed") if key in run.metrics}
    values = run.metrics.get("values")
    for key, value in (drawn | (dict(values) if isinstance(values, Mapping) else {})).items():
        lines.append(f"- {literal(key)}: {literal(value_of(value))}")
    rows = (
        (words(name), _with_unit(name, run.metrics[name]), literal(metric.meaning))
        for name, metric in METRICS.items()
        if name in run.metrics
    )
    return "\n".join([*lines, "", markdown_table(("number", "value", ""), rows)])


def plain_lines(text: str) -> str:
    """Several lines, each made safe to show."""
    return "\n".join(plain(line) for line in text.split("\n"))


def _with_unit(name: str, value: Any) -> str:
    text, unit = METRICS[name].text(value), METRICS[name].unit
    return f"{text} {unit}" if unit and text != "–" else text
