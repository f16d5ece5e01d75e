"""A gait as a limit cycle: multipliers in the unit circle, and the return map along its slowest direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from biped.figures.style import JOINTS, PUSH, QUIET, RIGHT, SETTINGS, figure, make_folder, save
from biped.stability.fit import Fit, Returns

_COLOURS = [*JOINTS.values(), PUSH]


def plot_stability(result: Mapping[str, Any], drawn: Sequence[tuple[Returns, Fit]], folder: Path) -> Path:
    """Draws a study.

    Args:
        result: As from `biped.stability.study`.
        drawn: Returns and fit of each of its rows.
        folder: Where stability.png goes; it is made if need be.

    Raises:
        InputError: The file cannot be written.
    """
    make_folder(folder)
    with matplotlib.rc_context(SETTINGS):
        page = figure(9.0, 4.2)
        circle, returns = page.subplots(1, 2)
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        circle.plot(np.cos(turn), np.sin(turn), color=QUIET)
        for colour, row in zip(_COLOURS, result["fits"], strict=False):
            real, imaginary = np.array(row["multipliers"]).T
            label = f"{row['steps']} steps, kicks of {row['kick']:g}"
            circle.plot(real, imaginary, "o", color=colour, markersize=4.0, label=label)
        circle.set(aspect="equal", xlabel="real", ylabel="imaginary", title=f"{result['scenario']}: multipliers")
        circle.legend(loc="upper left", bbox_to_anchor=(0.0, -0.14), fontsize=8)
        _return_map(returns, *drawn[0])
        return save(page, folder / "stability.png")


def _return_map(axes, pairs: Returns, fit: Fit) -> None:
    """The coordinate that the left eigenvector of the largest multiplier measures, before and after a return."""
    values, left = np.linalg.eig(fit.matrix.T)
    measure = np.real(left[:, np.argmax(np.abs(values))]) @ fit.basis
    measure = measure / np.linalg.norm(measure)
    x, y = (pairs.before - fit.mean) @ measure, (pairs.after - fit.mean) @ measure
    reach = np.array([x.min(), x.max()])
    axes.plot(reach, reach, color=QUIET, label="as before")
    axes.plot(reach, fit.multipliers[0].real * reach, color=PUSH, label="slope: the multiplier's real part")
    axes.plot(x, y, ".", color=RIGHT, markersize=3.0)
    axes.set(xlabel="before the return", ylabel="after it", title="slowest direction (natural units)")
    axes.legend(fontsize=8)
