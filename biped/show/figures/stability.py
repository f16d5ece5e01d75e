"""A gait as a limit cycle: what becomes of kicks of every size, and multipliers in the unit circle."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from biped.show.figures.style import JOINTS, LEFT, PUSH, QUIET, SETTINGS, figure, make_folder, save
from biped.studies.stability.basin import FELL, IMPOSSIBLE, RETURNED, WALKS
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


_OUTCOMES = {RETURNED: JOINTS["hip"], WALKS: JOINTS["ankle"], FELL: LEFT, IMPOSSIBLE: QUIET}
_WORDS = {
    RETURNED: "back on the gait", WALKS: "up, not back", FELL: "fell", IMPOSSIBLE: "no such posture",
}  # fmt: skip


def plot_basin(studied: Studied, folder: Path) -> Path:
    """Draws the slices of a study side by side into basin.png; returns the file.

    A cell mixes the colours of what became of the states that were changed there.

    Raises:
        InputError: The file cannot be written.
    """
    make_folder(folder)
    cuts = [(gait.place, gait.measured.basin) for gait in studied.gaits
            if gait.measured is not None and gait.measured.basin is not None]  # fmt: skip
    with matplotlib.rc_context(SETTINGS):
        page = figure(0.8 + 3.9 * len(cuts), 3.9)
        row = page.subplots(1, len(cuts), squeeze=False)[0]
        shown: set[str] = set()
        for axes, (place, cut) in zip(row, cuts, strict=True):
            share = {name: np.array(cut.counts[name]) / cut.states for name in _OUTCOMES}
            picture = sum(share[name][..., None] * np.array(to_rgb(colour)) for name, colour in _OUTCOMES.items())
            lean, speed = np.degrees(cut.lean), np.array(cut.speed)
            axes.pcolormesh(lean, speed, np.swapaxes(picture, 0, 1), shading="nearest")
            axes.plot(0.0, 0.0, "+", color="white", markersize=9.0)
            axes.grid(False)
            axes.set(xlabel="torso leans further forward by [degrees]", title=place)
            shown |= {name for name in _OUTCOMES if share[name].any()}
        row[0].set_ylabel("moves faster by [m/s]")
        patches = [Patch(color=_OUTCOMES[name], label=_WORDS[name]) for name in _OUTCOMES if name in shown]
        page.legend(handles=patches, loc="outside lower center", ncols=4, fontsize=8)
        page.suptitle(f"{studied.scenario}: slice of the basin of attraction", x=0.02, ha="left", fontsize=11.0)
        return save(page, folder / "basin.png")
