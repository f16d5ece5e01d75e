"""A gait as a limit cycle: what becomes of kicks of every size, and multipliers in the unit circle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from biped.show.figures.style import JOINTS, PUSH, QUIET, SETTINGS, figure, make_folder, save
from biped.studies.stability.fit import Fit
from biped.studies.stability.study import place

_COLOURS = [*JOINTS.values(), PUSH]


def plot_stability(result: Mapping[str, Any], drawn: Sequence[tuple[str, Fit]], folder: Path) -> Path:
    """Draws a study.

    Args:
        result: As from `biped.studies.stability.study`.
        drawn: Where each fit was made, and the fit.
        folder: Where stability.png goes; it is made if need be.

    Raises:
        InputError: The file cannot be written.
    """
    make_folder(folder)
    colours = {place(gait): colour for gait, colour in zip(result["gaits"], _COLOURS, strict=False)}
    with matplotlib.rc_context(SETTINGS):
        page = figure(9.0, 4.0)
        kicks, circle = page.subplots(1, 2)
        for gait in result["gaits"]:
            if "failed" not in gait:
                _sizes(kicks, gait, colours[place(gait)])
        low, high = kicks.get_xlim()
        kicks.plot([low, high], [low, high], color=QUIET, zorder=0, linewidth=1.0)
        kicks.set(xlim=(low, high), xlabel="size of the kick", ylabel="distance after three returns",
                  title=f"{result['scenario']}: kicks")  # fmt: skip
        kicks.legend(fontsize=8, loc="lower right")
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        circle.plot(np.cos(turn), np.sin(turn), color=QUIET)
        for where, fit in drawn:
            circle.plot(fit.multipliers.real, fit.multipliers.imag, "o", color=colours[where], markersize=4.0)
        circle.set(aspect="equal", xlabel="real", ylabel="imaginary", title="multipliers of the fitted map")
        return save(page, folder / "stability.png")


def _sizes(axes: Axes, gait: Mapping[str, Any], colour: str) -> None:
    rows = gait["sizes"]
    axes.loglog([row["size"] for row in rows], [row["after"][-1] for row in rows], "o-", color=colour, markersize=4.0,
                label=f"{place(gait)}: {gait['kind']}")  # fmt: skip
