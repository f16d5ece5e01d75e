"""The first strike of a foot in several engines beside each other: what their contacts make of one impact."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from biped.measure.trajectory import Trajectory
from biped.show.figures.style import figure

BEFORE, AFTER = 0.005, 0.025
"""[s] that are shown around it."""


def first_strike(t: Trajectory) -> tuple[int, int] | None:
    """Row and foot of the first time that a foot comes down from the air; None if none does."""
    loaded = t.foot_force > 0.0
    for row in np.flatnonzero((loaded[1:] & ~loaded[:-1]).any(axis=1)) + 1:
        for foot in np.flatnonzero(loaded[row] & ~loaded[row - 1]):
            if row * t.tick > 0.1 and not loaded[max(0, row - round(0.1 / t.tick)) : row, foot].any():
                return int(row), int(foot)
    return None


def strike(walkers: Mapping[str, Trajectory], title: str) -> Figure:
    """Normal force of the foot that strikes first, and of its most loaded point, over 30 ms.

    Args:
        walkers: Trajectories by the name of their engine.
        title: The scenario's name.
    """
    drawn = figure(8.0, 5.0)
    whole, single = drawn.subplots(2, 1, sharex=True)
    for i, (engine, t) in enumerate(walkers.items()):
        found = first_strike(t)
        if found is None:
            continue
        row, foot = found
        first, last = max(0, row - round(BEFORE / t.tick)), row + round(AFTER / t.tick)
        time, normal = 1e3 * t.tick * (np.arange(first, min(last, len(t))) - row), t.force[first:last, :, 2]
        points = normal[:, t.robot.of_foot == foot]
        label = f"{engine}, at {row * t.tick:.3f} s"
        whole.step(time, 1e-3 * t.foot_force[first:last, foot], where="post", color=f"C{i}", label=label)
        single.step(time, 1e-3 * points[:, points.max(axis=0).argmax()], where="post", color=f"C{i}", label=label)
    whole.set_title(f"{title}: the first strike")
    whole.set_ylabel("foot [kN]")
    single.set_ylabel("its most loaded point [kN]")
    single.set_xlabel("after the first contact [ms]")
    if whole.get_legend_handles_labels()[0]:
        whole.legend(loc="upper right")
    return drawn
