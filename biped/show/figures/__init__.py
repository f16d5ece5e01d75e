"""Figures as PNG files. This is the only package that imports matplotlib, and it draws without a screen.

Of a campaign: success over a sweep with its intervals, spread of the cost of transport, how runs failed.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biped.ensemble.columns import batches, smallest
from biped.ensemble.results import goal_at
from biped.measure.metrics.walking import TOLD_BY, kind_of
from biped.measure.signals import finite
from biped.measure.trajectory import Trajectory
from biped.show.document import value_of
from biped.show.figures import curves, strides
from biped.show.figures.curves import overlay, strike, strobe
from biped.show.figures.style import JOINTS, PUSH, QUIET, SETTINGS, figure, make_folder, save

_COLOURS = [*JOINTS.values(), PUSH, QUIET, "#0072B2", "#D55E00", "#56B4E9"]

Rows = Sequence[Mapping[str, Any]]


def rates(points: Rows, title: str) -> Figure:
    """Fraction of runs that walked, stood or sat at every point of a sweep with Wilson's 95 % intervals.

    The last key is the abscissa; the first, if there are two, makes the colours.

    Args:
        points: As from `biped.ensemble.results.by_point`.
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
        label = None if group is None else f"{keys[0]} = {value_of(group)}"
        axes.bar(x, rate, 0.9 * width, color=_COLOURS[i % len(_COLOURS)], label=label)
        axes.errorbar(x, rate, [rate - low, high - rate], fmt="none", ecolor="#374151", elinewidth=1.0, capsize=2.0)
    axes.set_xticks(range(len(places)), [value_of(place) for place in places])
    axes.set(ylim=(0.0, 1.05), xlabel=across, ylabel=f"fraction that {goal_at(points[0])[0]}", title=title)
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
    axes.set_xticks(range(len(columns)), [value_of(value) for value in columns])
    axes.set_yticks(range(len(rows)), [value_of(value) for value in rows])
    axes.set(xlabel=across, ylabel=up, title=title)
    drawn.colorbar(shown, label=f"fraction that {goal_at(points[0])[0]}")
    return drawn


def costs(rows: Rows, title: str) -> Figure:
    """Distribution of speed and net cost of transport over the runs that walked."""
    drawn = figure(7.0, 2.8)
    left, right = drawn.subplots(1, 2)
    walkers = sum(int(columns["walked"].sum()) for columns in batches(rows, ["walked"]))
    bins = min(40, max(8, walkers // 5))
    _bars(left, _of_walkers(rows, "speed"), bins, _COLOURS[0])
    left.set(xlabel="mean speed [m/s]", ylabel="runs", title=title)
    cost = _of_walkers(rows, "cost_of_transport")
    count = _bars(right, cost, bins, _COLOURS[2])
    middle = {(count - 1) // 2, count // 2} if count else set()
    median = f"median {np.mean([smallest(cost, rank) for rank in middle]):.3f}" if middle else ""
    right.set(xlabel="net cost of transport [-]", title=median)
    return drawn


def _of_walkers(rows: Rows, name: str) -> Callable[[], Iterator[np.ndarray]]:
    """A metric of the runs that walked, in pieces; without runs that have none."""

    def pieces() -> Iterator[np.ndarray]:
        for columns in batches(rows, ("walked", name)):
            values = columns[name][columns["walked"]]
            yield values[np.isfinite(values)]

    return pieces


def _bars(axes: Axes, pieces: Callable[[], Iterator[np.ndarray]], bins: int, colour: str) -> int:
    """Draws a histogram; returns how many numbers it counts."""
    ends = [(piece.min(), piece.max()) for piece in pieces() if piece.size]
    edges = np.histogram_bin_edges(np.array(ends), bins) if ends else np.linspace(0.0, 1.0, bins + 1)
    counts = np.zeros(bins, dtype=int)
    for piece in pieces():
        counts += np.histogram(piece, edges)[0]
    axes.hist(edges[:-1], list(edges), weights=counts, color=colour)
    return int(counts.sum())


def failures(rows: Rows, title: str) -> Figure:
    """When runs failed, by cause; runs that stayed up without walking are counted at the end."""
    longest = max((float(columns["time"].max()) for columns in batches(rows, ["time"])), default=0.0)
    bins = np.linspace(0.0, longest, 31)
    causes: dict[str, np.ndarray] = {}
    for columns in batches(rows, ("walked", "time", *TOLD_BY)):
        times: dict[str, list[float]] = {}
        for place in np.flatnonzero(~columns["walked"]):
            cause = kind_of({name: columns[name][place] for name in TOLD_BY})
            times.setdefault(cause, []).append(columns["time"][place])
        for cause, some in times.items():
            causes[cause] = causes.get(cause, 0) + np.histogram(some, bins)[0]
    drawn = figure(7.0, 2.8)
    axes = drawn.add_subplot()
    if causes:
        labels = [f"{cause} ({counts.sum()})" for cause, counts in causes.items()]
        colours = [_COLOURS[i % len(_COLOURS)] for i in range(len(causes))]
        places = [bins[:-1]] * len(causes)
        axes.hist(places, list(bins), weights=list(causes.values()), stacked=True, label=labels, color=colours)
        axes.legend(fontsize=8)
    axes.set(xlabel="time [s]", ylabel="runs", title=f"{title}: failures of {len(rows)} runs")
    return drawn


def _values(points: Rows, key: str) -> list[Any]:
    return list(dict.fromkeys(point["values"][key] for point in points))


__all__ = ["plot_campaign", "plot_ensemble", "plot_run", "plot_together"]

MAP_FROM = 16
"""Points of a two-dimensional sweep above which it is drawn as a map."""


def plot_run(trajectory: Trajectory, folder: Path, *, title: str, window: tuple[float, float]) -> list[Path]:
    """Draws the thesis's figures of a run, and its loads.

    Args:
        trajectory: The run.
        folder: Where the files go; it is made if need be.
        title: Of the run.
        window: [s] of steady walking.

    Returns:
        The files: walk, velocity, torso, phase, loads, strides if there was a whole one, and push if there was one.

    Raises:
        InputError: A file cannot be written.
    """
    make_folder(folder)
    trajectory = finite(trajectory)
    with matplotlib.rc_context(SETTINGS):
        drawn = {
            "walk": strobe(trajectory, title),
            "velocity": curves.velocity(trajectory, title, window),
            "torso": curves.torso(trajectory, title),
            "phase": curves.phase(trajectory, title, window),
            "loads": curves.loads(trajectory, title, window),
        }
        if (over_stride := strides.draw({title: trajectory}, title, window)) is not None:
            drawn["strides"] = over_stride
        if trajectory.pushes:
            drawn["push"] = curves.push(trajectory, title)
        return [save(figure, folder / f"{name}.png") for name, figure in drawn.items()]


def plot_together(walkers: Mapping[str, Trajectory], folder: Path, title: str) -> None:
    """Draws walkers of one scenario over each other, and the first strike of each.

    Args:
        walkers: Trajectories by the name of their engine.
        folder: Where overlay.png and strike.png are written.
        title: Of the scenario.

    Raises:
        InputError: A file cannot be written.
    """
    shown = {name: finite(walker) for name, walker in walkers.items()}
    with matplotlib.rc_context(SETTINGS):
        save(overlay(shown, title), folder / "overlay.png")
        save(strike(shown, title), folder / "strike.png")


def plot_ensemble(trajectories: Sequence[Trajectory], path: Path, title: str) -> None:
    """Draws the forward velocity of many runs against time (Fig 3.14).

    Args:
        trajectories: The runs.
        path: The PNG file.
        title: Of the ensemble.

    Raises:
        InputError: The file cannot be written.
    """
    with matplotlib.rc_context(SETTINGS):
        save(curves.ensemble([finite(t) for t in trajectories], title), path)


def plot_campaign(
    rows: Sequence[Mapping[str, Any]], points: Sequence[Mapping[str, Any]], folder: Path, *, title: str
) -> list[Path]:
    """Draws what a campaign says.

    Args:
        rows: Its runs' numbers.
        points: The points of its sweep, as from `biped.ensemble.results.by_point`; none without a sweep.
        folder: Where the files go; it is made if need be.
        title: Of the campaign.

    Returns:
        The files: rates (a map where a sweep is large), costs, failures.

    Raises:
        InputError: A file cannot be written.
    """
    make_folder(folder)
    with matplotlib.rc_context(SETTINGS):
        drawn = {}
        if points:
            large = len(points[0]["values"]) == 2 and len(points) > MAP_FROM
            drawn["rates"] = rate_map(points, title) if large else rates(points, title)
        drawn["costs"] = costs(rows, title)
        drawn["failures"] = failures(rows, title)
        return [save(figure, folder / f"{name}.png") for name, figure in drawn.items()]
