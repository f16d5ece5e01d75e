"""Figures of a campaign: success over a sweep with its intervals, spread of the cost of transport, how runs failed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from biped.measure.metrics.walking import kind_of
from biped.show.figures.style import JOINTS, PUSH, QUIET, figure

_COLOURS = [*JOINTS.values(), PUSH, QUIET, "#0072B2", "#D55E00", "#56B4E9"]

Rows = Sequence[Mapping[str, Any]]


def rates(points: Rows, title: str) -> Figure:
    """Fraction of runs that walked at every point of a sweep with Wilson's 95 % intervals.

    The last key is the abscissa; the first, if there are two, makes the colours.

    Args:
        points: As from `biped.ensemble.sweeps.by_point`.
        title: Of the campaign.
    """
    keys = list(points[0]["values"])
    across = keys[-1]
    groups = _values(points, keys[0]) if len(keys) == 2 else [None]
    places = _values(points, across)
    drawn = figure(max(6.0, 0.5 * len(places) * len(groups) + 2.0), 3.4)
    axes = drawn.add_subplot()
    width = 0.8 / len(groups)
    for i, group in enumerate(groups):
        mine = [p for p in points if group is None or p["values"][keys[0]] == group]
        x = np.array([places.index(p["values"][across]) for p in mine]) + (i - 0.5 * (len(groups) - 1)) * width
        rate = np.array([p["rate"] for p in mine])
        low, high = np.array([p["interval"] for p in mine]).T
        label = None if group is None else f"{keys[0]} = {_text(group)}"
        axes.bar(x, rate, 0.9 * width, color=_COLOURS[i % len(_COLOURS)], label=label)
        axes.errorbar(x, rate, [rate - low, high - rate], fmt="none", ecolor="#374151", elinewidth=1.0, capsize=2.0)
    axes.set_xticks(range(len(places)), [_text(place) for place in places])
    axes.set(ylim=(0.0, 1.05), xlabel=across, ylabel="fraction that walked", title=title)
    if groups != [None]:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)
    return drawn


def rate_map(points: Rows, title: str) -> Figure:
    """Success over a sweep of two keys as a map: the first key upwards, the last across."""
    up, across = list(points[0]["values"])
    rows, columns = _values(points, up), _values(points, across)
    grid = np.full((len(rows), len(columns)), np.nan)
    for p in points:
        grid[rows.index(p["values"][up]), columns.index(p["values"][across])] = p["rate"]
    drawn = figure(0.55 * len(columns) + 2.5, 0.36 * len(rows) + 1.6)
    axes = drawn.add_subplot()
    axes.grid(visible=False)
    shown = axes.imshow(grid, origin="lower", aspect="auto", cmap="cividis", vmin=0.0, vmax=1.0)
    for i in range(len(rows)):
        for j in range(len(columns)):
            if np.isfinite(grid[i, j]):
                shade = "black" if grid[i, j] > 0.5 else "white"
                axes.text(j, i, f"{grid[i, j]:.0%}", ha="center", va="center", color=shade, fontsize=7)
    axes.set_xticks(range(len(columns)), [_text(value) for value in columns])
    axes.set_yticks(range(len(rows)), [_text(value) for value in rows])
    axes.set(xlabel=across, ylabel=up, title=title)
    drawn.colorbar(shown, label="fraction that walked")
    return drawn


def costs(rows: Rows, title: str) -> Figure:
    """Distribution of speed and net cost of transport over the runs that walked."""
    walkers = [row for row in rows if row["walked"]]
    drawn = figure(7.0, 2.8)
    left, right = drawn.subplots(1, 2)
    bins = min(40, max(8, len(walkers) // 5))
    left.hist([row["speed"] for row in walkers], bins, color=_COLOURS[0])
    left.set(xlabel="mean speed [m/s]", ylabel="runs", title=title)
    cost = np.array([row["cost_of_transport"] for row in walkers])
    right.hist(cost, bins, color=_COLOURS[2])
    right.set(xlabel="net cost of transport [-]", title=f"median {np.median(cost):.3f}" if cost.size else "")
    return drawn


def failures(rows: Rows, title: str) -> Figure:
    """When runs failed, by cause; runs that stayed up without walking are counted at the end."""
    causes: dict[str, list[float]] = {}
    for row in rows:
        if not row["walked"]:
            causes.setdefault(kind_of(row), []).append(row["time"])
    drawn = figure(7.0, 2.8)
    axes = drawn.add_subplot()
    if causes:
        bins = list(np.linspace(0.0, max(row["time"] for row in rows), 31))
        labels = [f"{cause} ({len(times)})" for cause, times in causes.items()]
        colours = [_COLOURS[i % len(_COLOURS)] for i in range(len(causes))]
        axes.hist(list(causes.values()), bins, stacked=True, label=labels, color=colours)
        axes.legend(fontsize=8)
    axes.set(xlabel="time [s]", ylabel="runs", title=f"{title}: failures of {len(rows)} runs")
    return drawn


def _values(points: Rows, key: str) -> list[Any]:
    return list(dict.fromkeys(point["values"][key] for point in points))


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, int | float) else str(value)
