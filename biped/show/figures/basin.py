"""A slice through a gait's basin of attraction."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from biped.show.figures.style import JOINTS, LEFT, QUIET, SETTINGS, figure, make_folder, save
from biped.studies.stability.basin import FELL, IMPOSSIBLE, RETURNED, WALKS
from biped.studies.stability.gait import Studied

_COLOURS = {RETURNED: JOINTS["hip"], WALKS: JOINTS["ankle"], FELL: LEFT, IMPOSSIBLE: QUIET}
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
            share = {name: np.array(cut.counts[name]) / cut.states for name in _COLOURS}
            picture = sum(share[name][..., None] * np.array(to_rgb(colour)) for name, colour in _COLOURS.items())
            lean, speed = np.degrees(cut.lean), np.array(cut.speed)
            axes.pcolormesh(lean, speed, np.swapaxes(picture, 0, 1), shading="nearest")
            axes.plot(0.0, 0.0, "+", color="white", markersize=9.0)
            axes.grid(False)
            axes.set(xlabel="torso leans further forward by [degrees]", title=place)
            shown |= {name for name in _COLOURS if share[name].any()}
        row[0].set_ylabel("moves faster by [m/s]")
        patches = [Patch(color=_COLOURS[name], label=_WORDS[name]) for name in _COLOURS if name in shown]
        page.legend(handles=patches, loc="outside lower center", ncols=4, fontsize=8)
        page.suptitle(f"{studied.scenario}: slice of the basin of attraction", x=0.02, ha="left", fontsize=11.0)
        return save(page, folder / "basin.png")
