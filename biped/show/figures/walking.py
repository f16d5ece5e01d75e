"""Error against run time of a walk."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from biped.show.figures.style import JOINTS, LEFT, PUSH, QUIET, SETTINGS, TRUNK, figure, make_folder, save
from biped.studies.bench.walking import CANDIDATES

_COLOURS = [*JOINTS.values(), PUSH, TRUNK, LEFT]


def plot_walking(result: Mapping[str, Any], folder: Path) -> Path:
    """Draws what `biped bench walking` measured into walking.png; returns the file.

    Raises:
        InputError: The file cannot be written.
    """
    make_folder(folder)
    rows = [row for row in result["cases"] if row["group"] in CANDIDATES.values()]
    integrators = list(dict.fromkeys(row["label"].split()[0] for row in rows))
    with matplotlib.rc_context(SETTINGS):
        page = figure(9.0, 3.6)
        path, gait = page.subplots(1, 2)
        for colour, integrator in zip(_COLOURS, integrators, strict=False):
            mine = [row for row in rows if row["label"].split()[0] == integrator]
            cpu = [1e3 * row["cpu_per_second"] for row in mine]
            path.loglog(cpu, [row["error"] for row in mine], "o-", color=colour, label=integrator, markersize=4.0)
            shift = 100.0 * np.array([row["speed_shift"] for row in mine])
            half = 100.0 * np.array([row["speed_shift_half_width"] for row in mine])
            gait.errorbar(cpu, shift, half, fmt="o-", color=colour, label=integrator, markersize=4.0, capsize=2.0)
        gait.axhline(0.0, color=QUIET, zorder=0)
        gait.set_xscale("log")
        for axes in (path, gait):
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter(ScalarFormatter())
            axes.xaxis.set_minor_formatter(NullFormatter())
        path.set(xlabel="CPU ms per second of walking", ylabel="rad", title=f"error after {result['horizon']:g} s")
        gait.set(xlabel="CPU ms per second of walking", ylabel="%", title="shift of the steady speed")
        path.legend(fontsize=8)
        return save(page, folder / "walking.png")
