"""Recordings for the rerun viewer.

Rerun is imported here, and for a notebook by `biped.show.viewer`: a run that is not recorded does not pay for it.

The viewer opens with the walk from the side, lanes below it, on the right verdict, curves and text; a walker in space
is seen from ahead and from above too. The text is the verdict with five numbers, all numbers, the scenario.
"""

import hashlib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from biped.base.errors import InputError, markdown_table, plain
from biped.base.writing import Kind, may_write
from biped.ensemble.checks import FAILED, NOTHING, PASSED, UNDECIDED, word_of
from biped.measure.metrics.walking import outcome
from biped.measure.pushes import pushes_of
from biped.measure.signals import every
from biped.measure.trajectory import Trajectory
from biped.scenario.metrics import METRICS
from biped.show.document import literal, value_of, words
from biped.show.recording.scene import PICTURES, STEPS, log_body, log_scene
from biped.show.recording.series import SIGNAL, Placed, Recorded, colour_word, curves, log_series, log_states, place

__all__ = ["Recorded", "record"]


KIND = Kind("a recording", (), (b"RRF2",))


def record(path: Path, runs: Sequence[Recorded], *, title: str) -> None:
    """Writes one recording of one or several runs, side by side or, ghosts, over the run before them.

    The same runs give the same content.

    Args:
        path: The .rrd file.
        runs: What to record; names differ.
        title: What the viewer calls the recording.

    Raises:
        InputError: The file cannot be written, something else is there, or a run is finite at no time.
    """
    may_write(path, "recording", KIND)
    placed = place(runs)
    try:
        path.open("wb").close()  # rerun would say so only after taking data for it
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    # The viewer keeps one layout per application, and a layout names entities: other names, another one.
    names = "\n".join(run.root for run in placed)
    application = "biped-" + hashlib.sha256(names.encode()).hexdigest()[:8]
    with rr.RecordingStream(application, recording_id=_identity(placed, title), send_properties=False) as recording:
        recording.save(path, default_blueprint=layout(placed))
        recording.send_recording_name(title)
        recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for run in placed:
            rows = every(run.run.trajectory, PICTURES)
            log_body(recording, run, rows)
            log_scene(recording, run, rows)
            log_series(recording, run)
            log_states(recording, run)
            log_report(recording, run)


def _identity(runs: list[Placed], title: str) -> str:
    """A recording id that follows from what is recorded."""
    digest = hashlib.sha256(title.encode())
    for placed in runs:
        digest.update(f"{placed.root}\n{placed.run.ghost}\n{placed.run.scenario_text}\n".encode())
        digest.update(placed.run.trajectory.log.tobytes())
    return digest.hexdigest()[:32]


# The eye and what it looks at [m from the ground below]: it is seen from its right and walks rightwards.
# Plots in which every run has a curve; the others are of the first run.
_SHARED = ("velocity", "torso", "cost")
# The eye of a smaller view is nearer, by this.
_NEARER = 0.6
# What hides the ground from above, or stands aside of where it belongs for being high.
_ALOFT = ("body", "centre_of_mass", "trail", "contact_force")
# What stays in sight once it was seen.
_KEPT = ("trail", *STEPS)


def layout(runs: list[Placed]) -> rrb.Blueprint:
    """The blueprint of a recording."""
    of_runs = [{plot.entity: plot.title for plot in curves(run)} for run in runs]
    # A ghost or a run beside the first may have curves that the first has not.
    titles = {entity: title for found in reversed(of_runs) for entity, title in found.items()}
    plots = {
        entity: rrb.TimeSeriesView(
            name=titles[entity] + (_whose(runs) if entity in _SHARED and len(runs) > 1 else ""),
            origin="/",
            contents=[
                run.entity("series", entity)
                for run, found in zip(runs if entity in _SHARED else runs[:1], of_runs, strict=False)
                if entity in found
            ],
            # A legend hides curves wherever it is: titles say what colours stand for.
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for entity in titles
    }
    details = rrb.Tabs(*(_details(run) for run in runs), name="Runs") if len(runs) > 1 else _details(runs[0])
    left = rrb.Vertical(_walk(runs), details, row_shares=[5, 3])
    right = rrb.Vertical(
        rrb.Tabs(*(plots[entity] for entity in _SHARED if entity in plots)),
        plots["angle"],
        plots["torque"],
        rrb.Tabs(plots["force"], plots["power"], *(plots[name] for name in plots if name.startswith(SIGNAL))),
    )
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[8, 5]),
        rrb.TimePanel(state="collapsed", timeline="time"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def _whose(runs: list[Placed]) -> str:
    """Which colour is whose, for the title of a plot."""
    return ": " + ", ".join(f"{run.run.name} {colour_word(run.number)}" for run in runs)


def _walk(runs: list[Placed]) -> rrb.Spatial3DView | rrb.Horizontal:
    """The walk from its right; of a walker in space from ahead and from above beside that."""
    aside = max(run.lane for run in runs)
    shown = runs[0].run.trajectory.robot.shown
    target = np.array([shown.target[0], shown.target[1] + 0.5 * aside, shown.target[2]])
    away = (1.0 + 0.3 * aside) * (np.array(shown.eye) - shown.target)
    side = _view(runs, "Walk", target, away, (0.0, 0.0, 1.0))
    if not any(in_space(run.run.trajectory) for run in runs):
        return side
    far = float(np.linalg.norm(away))
    ahead = _view(runs, "From ahead", target, _NEARER * far * np.array([1.0, 0.0, 0.12]), (0.0, 0.0, 1.0))
    # A little from behind: straight down, "up" would be no direction.
    low = target * [1.0, 1.0, 0.0]
    above = _view(runs, "Steps, from above", low, far * np.array([-0.01, 0.0, 1.0]), (1.0, 0.0, 0.0), _ALOFT)
    return rrb.Horizontal(side, rrb.Vertical(ahead, above), column_shares=[3, 2])


def in_space(trajectory: Trajectory) -> bool:
    """Whether a run is one of a robot that moves in space."""
    return not trajectory.robot.planar


def _view(
    runs: list[Placed], name: str, target: np.ndarray, away: np.ndarray, up: tuple[float, float, float],
    without: Sequence[str] = (),
) -> rrb.Spatial3DView:  # fmt: skip
    """A 3D view of `target` [m] from `away` [m] of it, from a frame that goes along with the first run.

    Some entities of the scenes may be left out.

    (An eye that tracks an entity does not move when it is given a place of its own.)
    """
    contents = [run.entity("scene") + "/**" for run in runs]
    contents += ["- " + run.entity("scene", name) + "/**" for run in runs for name in without]
    past = rr.VisibleTimeRange(
        "time", start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.cursor_relative()
    )
    return rrb.Spatial3DView(
        name=name,
        origin=runs[0].entity("eye"),
        contents=contents,
        background=rrb.Background(color=(232, 236, 241)),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=target + away, look_target=target, eye_up=up
        ),
        overrides={run.entity("scene", name): rrb.VisibleTimeRanges(past) for run in runs for name in _KEPT},
    )


def _details(run: Placed) -> rrb.Container:
    """Verdict, scenario and lanes of one run."""
    return rrb.Horizontal(
        rrb.Tabs(
            rrb.StateTimelineView(name="Leg states and contacts", origin=run.entity("states")),
            rrb.StateTimelineView(name="Constraints in A", origin=run.entity("constraints")),
        ),
        rrb.Tabs(
            rrb.TextDocumentView(name="Result", origin=run.entity("result")),
            rrb.TextDocumentView(name="All numbers", origin=run.entity("numbers")),
            rrb.TextDocumentView(name="Scenario", origin=run.entity("scenario")),
        ),
        column_shares=[5, 3],
        name=run.run.name,
    )


FIVE = ("speed", "cost_of_transport", "double_support", "step_length", "peak_torque")
"""Entities that the viewer shows first."""


def log_report(recording: rr.RecordingStream, placed: Placed) -> None:
    """Logs a run's verdict, its numbers and its scenario as Markdown."""
    text = "\n".join(map(plain, placed.run.scenario_text.strip().split("\n")))
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
            "Warnings: " + ", ".join(f"{literal(n)} ({k} times)" for n, k in trajectory.warnings.items()),
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


def _with_unit(name: str, value: Any) -> str:
    text, unit = METRICS[name].text(value), METRICS[name].unit
    return f"{text} {unit}" if unit and text != "–" else text
