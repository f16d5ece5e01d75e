"""How the viewer opens: the walk from the side, lanes below it, verdict and curves on the right."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from biped.show.recording.recorded import Placed
from biped.show.recording.series import SIGNAL, colour_word, curves

# The eye and what it looks at [m from the ground below]: it is seen from its right and walks rightwards.
# Plots in which every run has a curve; the others are of the first run.
_SHARED = ("velocity", "torso", "cost")


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


def _walk(runs: list[Placed]) -> rrb.Spatial3DView:
    """The 3D view, seen from a frame that goes along with the first run.

    (An eye that tracks an entity does not move when it is given a place of its own.)
    """
    aside = max(run.lane for run in runs)
    shown = runs[0].run.trajectory.robot.shown
    target = np.array([shown.target[0], shown.target[1] + 0.5 * aside, shown.target[2]])
    eye = target + (1.0 + 0.3 * aside) * (np.array(shown.eye) - shown.target)
    past = rr.VisibleTimeRange(
        "time", start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.cursor_relative()
    )
    return rrb.Spatial3DView(
        name="Walk",
        origin=runs[0].entity("eye"),
        contents=[run.entity("scene") + "/**" for run in runs],
        background=rrb.Background(color=(232, 236, 241)),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=eye,
            look_target=target,
            eye_up=[0.0, 0.0, 1.0],
        ),
        overrides={run.entity("scene", "trail"): rrb.VisibleTimeRanges(past) for run in runs},
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
