"""Figures as PNG files. This is the only package that imports matplotlib, and it draws without a screen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

from biped.errors import InputError
from biped.figures import curves
from biped.figures.strobe import strobe
from biped.figures.style import SETTINGS, save
from biped.signals import finite
from biped.trajectory import Trajectory

__all__ = ["plot_ensemble", "plot_run"]


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
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
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
