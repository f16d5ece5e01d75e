"""Figures as PNG files. This is the only package that imports matplotlib, and it draws without a screen."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

from biped.measure.signals import finite
from biped.measure.trajectory import Trajectory
from biped.show.figures import campaign, curves
from biped.show.figures.curves import overlay, strike, strobe
from biped.show.figures.style import SETTINGS, make_folder, save

__all__ = ["plot_campaign", "plot_ensemble", "plot_run", "plot_together"]

MAP_FROM = 16
"""Points of a two-dimensional sweep above which it is drawn as a map."""


def plot_run(trajectory: Trajectory, folder: Path, *, title: str, window: tuple[float, float]) -> list[Path]:
    """Draws the thesis's figures of a run, and its loads.

    Args:
        trajectory: The run.
        folder: Where the files go; it is made if need be.
        title: Of the run.
        window: [s] of steady walking.

    Returns:
        The files: walk, velocity, torso, phase, loads, and push if there was one.

    Raises:
        InputError: A file cannot be written.
    """
    make_folder(folder)
    trajectory = finite(trajectory)
    with matplotlib.rc_context(SETTINGS):
        drawn = {
            "walk": strobe(trajectory, title),
            "velocity": curves.velocity(trajectory, title, window),
            "torso": curves.torso(trajectory, title),
            "phase": curves.phase(trajectory, title, window),
            "loads": curves.loads(trajectory, title, window),
        }
        if trajectory.pushes:
            drawn["push"] = curves.push(trajectory, title)
        return [save(figure, folder / f"{name}.png") for name, figure in drawn.items()]


def plot_together(walkers: Mapping[str, Trajectory], folder: Path, title: str) -> None:
    """Draws walkers of one scenario over each other, and the first strike of each.

    Args:
        walkers: Trajectories by the name of their engine.
        folder: Where overlay.png and strike.png are written.
        title: Of the scenario.

    Raises:
        InputError: A file cannot be written.
    """
    shown = {name: finite(walker) for name, walker in walkers.items()}
    with matplotlib.rc_context(SETTINGS):
        save(overlay(shown, title), folder / "overlay.png")
        save(strike(shown, title), folder / "strike.png")


def plot_ensemble(trajectories: Sequence[Trajectory], path: Path, title: str) -> None:
    """Draws the forward velocity of many runs against time (Fig 3.14).

    Args:
        trajectories: The runs.
        path: The PNG file.
        title: Of the ensemble.

    Raises:
        InputError: The file cannot be written.
    """
    with matplotlib.rc_context(SETTINGS):
        save(curves.ensemble([finite(t) for t in trajectories], title), path)


def plot_campaign(
    rows: Sequence[Mapping[str, Any]], points: Sequence[Mapping[str, Any]], folder: Path, *, title: str
) -> list[Path]:
    """Draws what a campaign says.

    Args:
        rows: Its runs' numbers.
        points: The points of its sweep, as from `biped.ensemble.results.by_point`; none without a sweep.
        folder: Where the files go; it is made if need be.
        title: Of the campaign.

    Returns:
        The files: rates (a map where a sweep is large), costs, failures.

    Raises:
        InputError: A file cannot be written.
    """
    make_folder(folder)
    with matplotlib.rc_context(SETTINGS):
        drawn = {}
        if points:
            large = len(points[0]["values"]) == 2 and len(points) > MAP_FROM
            drawn["rates"] = campaign.rate_map(points, title) if large else campaign.rates(points, title)
        drawn["costs"] = campaign.costs(rows, title)
        drawn["failures"] = campaign.failures(rows, title)
        return [save(figure, folder / f"{name}.png") for name, figure in drawn.items()]
