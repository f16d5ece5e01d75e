"""Figs 4.7 and 4.8: the robot's legs on the bench."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np

from biped.show.figures.style import (
    JOINTS,
    LEFT,
    QUIET,
    RIGHT,
    SETTINGS,
    TRUNK,
    figure,
    legend_above,
    make_folder,
    save,
    timed,
)
from biped.studies.bench.followed import Followed
from biped.studies.bench.robot import Report
from biped.studies.bench.swings import Swing

_COLOURS = (RIGHT, LEFT, QUIET, TRUNK)
_STYLES = ("-", "--", ":", "-.")
_SHOWN = 8.0 / 3.0
"""[s] of the moving references, at the end, where the response is steady."""


def plot_bench(report: Report, folder: Path) -> list[Path]:
    """Draws both figures into a folder, which is made if need be; returns the files.

    Raises:
        InputError: A file cannot be written.
    """
    make_folder(folder)
    with matplotlib.rc_context(SETTINGS):
        drawn = {"fig_4_7": _swings(report.swings), "fig_4_8": _followed(report.followed)}
        return [save(page, folder / f"{name}.png") for name, page in drawn.items()]


def _swings(swings: tuple[Swing, ...]):
    page = figure(9.0, 3.8)
    for axes, joint in zip(page.subplots(1, 2), ("hip", "knee"), strict=True):
        mine = [swing for swing in swings if swing.joint == joint]
        for i, swing in enumerate(mine):
            colour = _COLOURS[i]
            axes.plot(swing.time, np.degrees(swing.angle), _STYLES[i], color=colour, label=swing.reading.name)
        timed(axes, f"{joint} swings freely", "degrees")
    page.legend(*page.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8)
    return page


def _followed(followed: Followed):
    page = figure(9.0, 6.0)
    rows = followed.time > followed.time[-1] - _SHOWN
    time = followed.time[rows] - followed.time[rows][0]
    for i, (axes, joint) in enumerate(zip(page.subplots(3, 1, sharex=True), JOINTS, strict=True)):
        axes.plot(time, np.degrees(followed.reference[rows, i]), "--", color=QUIET, label="reference")
        axes.plot(time, np.degrees(followed.angle[rows, i]), color=JOINTS[joint], label="model")
        one = followed.steady[i]
        timed(axes, f"{joint}: {one.amplitude:.1f} degrees, {one.lag:.0f} behind", "degrees")
        legend_above(axes, 2)
    return page
