"""Angles of hip, knee and ankle over a stride, as gait laboratories draw them, beside those of people who walk."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biped.measure import signals
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import LEGS, SEGMENTS
from biped.show.figures.style import JOINTS, LEFT, PUSH, QUIET, RIGHT, figure

PERCENT = np.linspace(0.0, 100.0, 101)
"""Of a stride, from a foot's strike to the next strike of the same foot."""
COLOURS = RIGHT, LEFT, JOINTS["ankle"], JOINTS["knee"], PUSH
"""Of the walks, in their order."""
_SIGNS = {"hip": 1.0, "knee": -1.0, "ankle": 1.0}
"""Flexion, and the foot towards the shank, are positive; the joint angles of a trajectory have the thesis's signs."""

PEOPLE: dict[str, tuple[tuple[float, float], ...]] = {
    "hip": ((0, 20), (10, 17), (20, 11), (30, 3), (40, -5), (52, -11), (60, -7), (70, 8), (80, 19), (88, 23), (95, 22)),
    "knee": ((0, 4), (14, 20), (25, 14), (40, 6), (50, 12), (57, 28), (66, 57), (72, 65), (80, 49), (88, 22), (98, 1)),
    "ankle": ((0, 0), (7, -6), (15, 0), (30, 6), (45, 10), (52, 5), (58, -6), (63, -17), (70, -8), (78, 0), (88, 2)),
}
"""Percent of a stride and degrees through which the mean of adults goes who walk as fast as they like.

Read off the curves of D. A. Winter, The Biomechanics and Motor Control of Human Gait (1991), to about 3°. One person
differs from the mean by about 5°.
"""


def of_people(joint: str) -> np.ndarray:
    """(101,) [degrees] the mean of people over a stride, by a monotone cubic through `PEOPLE` that is periodic.

    Args:
        joint: `hip`, `knee` or `ankle`.
    """
    from scipy.interpolate import PchipInterpolator

    percent, degrees = np.array(PEOPLE[joint], dtype=float).T
    around = np.concatenate([percent - 100.0, percent, percent + 100.0])
    return PchipInterpolator(around, np.tile(degrees, 3))(PERCENT)


def strides(t: Trajectory, window: tuple[float, float]) -> np.ndarray:
    """(k, 3, 101) [degrees] of hip, knee and ankle over each whole stride in a window, of either leg.

    Args:
        t: The run.
        window: [s].
    """
    rows = np.flatnonzero(signals.inside(t, window))
    angles = np.degrees(t.joint_angles)
    strikes = t.strikes_in(slice(rows[0], rows[-1] + 1)) if len(rows) else []
    found = []
    for leg in range(LEGS):
        for first, last in pairwise(row for row, foot in strikes if foot == leg):
            at = first + PERCENT / 100.0 * (last - first)
            found.append(
                [
                    sign * np.interp(at, np.arange(first, last + 1), angles[first : last + 1, SEGMENTS * leg + joint])
                    for joint, sign in enumerate(_SIGNS.values())
                ]
            )
    return np.array(found).reshape(-1, SEGMENTS, len(PERCENT))


def draw(walks: Mapping[str, Trajectory], title: str, window: tuple[float, float]) -> Figure | None:
    """Draws hip, knee and ankle over a stride: a walk's strides and their mean; of several walks the means.

    Args:
        walks: Runs by name, one or more.
        title: Of the figure.
        window: [s] of steady walking.

    Returns:
        The figure; None if no leg takes a whole stride in the window.
    """
    of = {name: strides(t, window) for name, t in walks.items()}
    if not all(map(len, of.values())):
        return None
    drawn = figure(9.5, 3.4)
    for joint, (axes, name) in enumerate(zip(drawn.subplots(1, SEGMENTS), _SIGNS, strict=True)):
        axes.plot(PERCENT, of_people(name), "--", color=QUIET, label="people (Winter)")
        for colour, (walk, angles) in zip(COLOURS, of.items(), strict=False):
            if len(of) == 1:
                axes.plot(PERCENT, angles[:, joint].T, color=colour, linewidth=0.5, alpha=0.25)
            axes.plot(PERCENT, angles[:, joint].mean(axis=0), color=colour, label=walk)
        _label(axes, name)
    drawn.axes[0].set_ylabel("flexion [°]")
    drawn.legend(*drawn.axes[0].get_legend_handles_labels(), loc="upper right", ncols=1 + len(of), fontsize=8)
    drawn.suptitle(f"{title}: joint angles over a stride", fontsize=11, x=0.01, ha="left")
    return drawn


def _label(axes: Axes, joint: str) -> None:
    axes.set_title(joint if joint != "ankle" else "ankle, toes up is positive")
    axes.set_xlabel("of a stride, from strike to strike [%]")
    axes.set_xlim(0.0, 100.0)
