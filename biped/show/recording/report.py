"""The text beside the picture: verdict, numbers, expectations; and the scenario."""

from __future__ import annotations

from typing import Any

import rerun as rr

from biped.show.recording.recorded import Placed, Recorded


def log_report(recording: rr.RecordingStream, placed: Placed) -> None:
    """Logs a run's verdict and scenario as Markdown."""
    for name, text in (
        ("result", result(placed.run)),
        ("scenario", f"```toml\n{placed.run.scenario_text.strip()}\n```"),
    ):
        document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
        recording.log(placed.entity(name), document, static=True)


def result(run: Recorded) -> str:
    """The verdict of a run in Markdown."""
    trajectory = run.trajectory
    distance = trajectory.q[-1, 0] - trajectory.q[0, 0]
    ending = trajectory.cause or "stayed up to the end"
    failed = [name for name, _, _, passed in run.checks if not passed]
    lines = [f"## {run.name}: {ending}", f"{trajectory.time[-1] + trajectory.tick:.1f} s, {distance:.2f} m"]
    if trajectory.slope:
        lines[-1] += f", slope {trajectory.slope:+g}°"
    if trajectory.generalized:
        lines[-1] += ", generalized forces (no robot can apply them)"
    for start, end, forward, up, body in trajectory.pushes:
        lines.append(f"- push on the {body}: {forward:g} N forward, {up:g} N up, {start:g} to {end:g} s")
    if run.checks:
        verdict = f"**FAILED**: {', '.join(failed)}" if failed else "**passed**: all expectations met"
        lines += ["", verdict, "", "| expected | | value | |", "|---|---|---|---|"]
        for name, value, expected, passed in run.checks:
            mark = "ok" if passed else "**FAILED**"
            lines.append(f"| {_words(name)} | {_show(expected)} | {_show(value)} | {mark} |")
    if run.metrics:
        lines += ["", "| metric | value |", "|---|---|"]
        lines += [f"| {_words(name)} | {_show(value)} |" for name, value in run.metrics.items()]
    if trajectory.warnings:
        lines += [
            "",
            "MuJoCo warned: " + ", ".join(f"{n} ({k} times)" for n, k in trajectory.warnings.items()),
        ]
    return "\n".join(lines)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _show(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(_show(v) for v in value)
    return "-" if value is None else str(value)
