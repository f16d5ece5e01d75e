"""How a search for gains went."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

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
