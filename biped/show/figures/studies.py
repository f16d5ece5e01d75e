"""Figures of studies: a gait's stability, a search for gains, accuracy against run time."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from biped.base.statistics import wilson
from biped.show.figures.style import JOINTS, LEFT, PUSH, QUIET, RIGHT, SETTINGS, TRUNK, figure, make_folder, save
from biped.studies.bench.walking import CANDIDATES
from biped.studies.stability import Gait, MeasuredGait, Studied
from biped.studies.stability.basin import FELL, IMPOSSIBLE, RETURNED, WALKS

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


def plot_search(journal: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draws the objective and the share of walking runs over the generations.

    Args:
        journal: The search's records, one per generation.
        path: The PNG file.

    Raises:
        InputError: The file cannot be written.
    """
    numbers = [r["index"] for r in journal]
    checked = [r for r in journal if "recheck" in r]
    at = [r["index"] for r in checked]
    with matplotlib.rc_context(SETTINGS):
        page = figure(8.0, 5.0)
        top, bottom = page.subplots(2, 1, sharex=True)
        middle = [sorted(r["costs"])[len(r["costs"]) // 2] for r in journal]
        top.plot(numbers, middle, color=QUIET, label="median of the generation")
        top.plot(numbers, [min(r["costs"]) for r in journal], color=RIGHT, label="best of the generation (flattered)")
        top.plot(at, [r["recheck"] for r in checked], "o-", color=LEFT, label="mean gait, fresh seeds")
        top.set_ylabel("objective")
        bottom.plot(numbers, [r["walked"] / r["runs"] for r in journal], color=QUIET, label="all runs of a generation")
        rates = [sum(t[0] for t in r["tallies"].values()) / sum(t[1] for t in r["tallies"].values()) for r in checked]
        bottom.plot(at, rates, "o-", color=LEFT, label="mean gait, fresh seeds")
        bottom.set(ylabel="share that walks", xlabel="generation")
        for axes in (top, bottom):
            axes.legend(fontsize=8)
        save(page, path)


def plot_least(steps: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draws, for every condition, the share of runs that did what they should against the number of gains changed.

    Args:
        steps: Of a way back (`biped.studies.tune.least`), in order.
        path: The PNG file.

    Raises:
        InputError: The file cannot be written.
    """
    changed = [step["changed"] for step in steps]
    with matplotlib.rc_context(SETTINGS):
        page = figure(8.0, 4.4)
        axes = page.subplots()
        colours = [LEFT, RIGHT, QUIET, "C4", "C5", "C6", "C8", "C9"]
        for colour, name in zip(colours * len(steps[0]["tallies"]), steps[0]["tallies"], strict=False):
            tallies = [step["tallies"][name] for step in steps]
            axes.plot(changed, [good / runs for good, runs in tallies], "o-", color=colour, label=name, markersize=3)
            low, high = zip(*(wilson(good, runs) for good, runs in tallies), strict=True)
            axes.fill_between(changed, low, high, color=colour, alpha=0.12, linewidth=0.0)
        for step in steps[1:]:
            axes.annotate(step["restored"], (step["changed"] + 0.5, 1.03), rotation=90, fontsize=6.5, ha="center",
                          va="bottom", color=QUIET, annotation_clip=False)  # fmt: skip
        axes.set(xlabel="gains that differ from the first gait (names: put back in this order, from the right)",
                 ylabel="share of runs", ylim=(-0.02, 1.02))  # fmt: skip
        axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        save(page, path)


_INTEGRATORS = [*JOINTS.values(), PUSH, TRUNK, LEFT]


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
        for colour, integrator in zip(_INTEGRATORS, integrators, strict=False):
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
