"""A gait as a limit cycle: what becomes of kicks of every size, and multipliers in the unit circle."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from biped.show.figures.style import JOINTS, PUSH, QUIET, SETTINGS, figure, make_folder, save
from biped.studies.stability.gait import Gait, MeasuredGait, Studied

_COLOURS = [*JOINTS.values(), PUSH]


def plot_stability(studied: Studied, folder: Path) -> Path:
    """Draws a study.

    Args:
        studied: The gait in every place.
        folder: Where stability.png goes; it is made if need be.

    Raises:
        InputError: The file cannot be written.
    """
    make_folder(folder)
    walking = [(gait, gait.measured, colour) for gait, colour in zip(studied.gaits, _COLOURS, strict=False)
               if gait.measured is not None]  # fmt: skip
    with matplotlib.rc_context(SETTINGS):
        page = figure(9.0, 4.0)
        kicks, circle = page.subplots(1, 2)
        for gait, measured, colour in walking:
            _sizes(kicks, gait, measured, colour)
        low, high = kicks.get_xlim()
        kicks.plot([low, high], [low, high], color=QUIET, zorder=0, linewidth=1.0)
        kicks.set(xlim=(low, high), xlabel="size of the kick", ylabel="distance after three returns",
                  title=f"{studied.scenario}: kicks")  # fmt: skip
        kicks.legend(fontsize=8, loc="lower right")
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        circle.plot(np.cos(turn), np.sin(turn), color=QUIET)
        for _, measured, colour in walking:
            multipliers = measured.kicked.fit.multipliers
            circle.plot(np.real(multipliers), np.imag(multipliers), "o", color=colour, markersize=4.0)
        circle.set(aspect="equal", xlabel="real", ylabel="imaginary", title="multipliers of the fitted map")
        return save(page, folder / "stability.png")


def _sizes(axes: Axes, gait: Gait, measured: MeasuredGait, colour: str) -> None:
    rows = measured.sizes
    axes.loglog([row.size for row in rows], [row.after[-1] for row in rows], "o-", color=colour, markersize=4.0,
                label=f"{gait.place}: {measured.kind}")  # fmt: skip
