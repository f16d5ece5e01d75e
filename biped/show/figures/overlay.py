"""Two walkers of one scenario over each other: forward velocity and joint angles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from biped.measure.trajectory import Trajectory
from biped.show.figures.curves import smooth
from biped.show.figures.style import LEFT, RIGHT, figure, timed

_COLOURS = (LEFT, RIGHT)
_LAST = 3.0
"""[s] of joint angles shown: at the end, where the gait is steady."""


def overlay(walkers: Mapping[str, Trajectory], title: str) -> Figure:
    """Velocity over the whole run, and the right leg's joint angles over its last seconds.

    Args:
        walkers: Two trajectories by the name of their engine.
        title: The scenario's name.
    """
    drawn = figure(8.0, 8.0)
    velocity, *joints = drawn.subplots(4, 1)
    timed(velocity, f"{title}: forward velocity of the torso", "velocity [m/s]")
    end = min(float(t.time[-1]) for t in walkers.values())
    for (engine, t), colour in zip(walkers.items(), _COLOURS, strict=True):
        velocity.plot(t.time, smooth(t.v[:, 0], t.tick), color=colour, label=engine, alpha=0.8)
        shown = (t.time >= end - _LAST) & (t.time <= end)
        for i, (name, axes) in enumerate(zip(("hip", "knee", "ankle"), joints, strict=True)):
            timed(axes, f"right {name}", "angle [°]")
            axes.plot(t.time[shown], np.degrees(t.q[shown, 3 + i]), color=colour, alpha=0.8)
    velocity.legend(loc="lower right")
    for axes in (velocity, *joints[:-1]):
        axes.set_xlabel("")
    return drawn
