"""How a search for gains went."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

from biped.base.statistics import wilson
from biped.show.figures.style import LEFT, QUIET, RIGHT, SETTINGS, figure, save


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
