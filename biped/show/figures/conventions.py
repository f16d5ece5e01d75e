"""The picture of docs/controllers.md: absolute angles, joint angles and rows of A with their signs.

`python -m biped.show.figures.conventions` writes it.
"""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc

from biped.base.files import folder
from biped.ensemble.plan import Plan
from biped.robot.planar.topology import FOOT, HEEL, NQ, PITCH, SHANK, THIGH, TOE, TORSO, X
from biped.robot.planar.tree import ABSOLUTE_OFFSET, Motion, motion
from biped.robot.robot import Robot
from biped.scenario.keys import Scenario, Start
from biped.show.figures.style import LEFT, QUIET, RIGHT, SETTINGS, TRUNK, figure, save

PAGE = folder("models").parent / "docs" / "figures" / "conventions.png"
_LEGS = (RIGHT, LEFT)
_HEAD = 0.55
"""[m] drawn of the trunk above the torso's centre of mass."""


def plot_conventions(path: Path) -> Path:
    """Draws the human in a step, its angles and its rows of A; returns the file.

    Raises:
        InputError: The file cannot be written.
    """
    run = Plan(Scenario(start=Start(posture="heel_toe"))).run(0)
    q = run.q.copy()
    q[X] = 0.0
    at = motion(run.tree, q, np.zeros(NQ))
    with matplotlib.rc_context(SETTINGS):
        page = figure(12.0, 6.4)
        left, middle, right = page.subplots(1, 3)
        _absolute(left, at)
        _joints(middle, at)
        _rows(right, at, run.robot)
        return save(page, path)


def _body(axes: Axes, at: Motion, title: str) -> None:
    up = at.com[TORSO] - at.joint[THIGH[0]]
    head = at.com[TORSO] + _HEAD * up / np.hypot(*up)
    hip = at.joint[THIGH[0]]
    axes.plot(*np.array([hip, head]).T, color=TRUNK, linewidth=5.0, solid_capstyle="round", alpha=0.6)
    for leg in (1, 0):
        ankle = at.joint[FOOT[leg]]
        chain = np.array([hip, at.joint[SHANK[leg]], ankle])
        axes.plot(*chain.T, color=_LEGS[leg], linewidth=4.0, solid_capstyle="round", alpha=0.6)
        foot = np.array([at.point[HEEL[leg]], ankle, at.point[TOE[leg]], at.point[HEEL[leg]]])
        axes.fill(*foot.T, color=_LEGS[leg], alpha=0.6, linewidth=0)
    axes.axhline(0.0, color=QUIET)
    axes.annotate("x, walking", (-0.28, 0.95), (-0.72, 0.95), fontsize=8, arrowprops={"arrowstyle": "->"}, va="center")
    axes.set(aspect="equal", title=title, xlim=(-0.75, 0.75), ylim=(-0.22, 1.9), xticks=[], yticks=[])
    axes.grid(False)
    for side in axes.spines.values():
        side.set_visible(False)


def _arrow(colour: str) -> dict[str, Any]:
    return {"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0}


def _xy(place: np.ndarray) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _arc(axes: Axes, place: np.ndarray, begin: float, end: float, text: str, colour: str, size: float = 0.16) -> None:
    """An angle from begin to end [rad] with an arrow's head and a name."""
    low, high = sorted((np.degrees(begin), np.degrees(end)))
    axes.add_patch(Arc(_xy(place), 2 * size, 2 * size, theta1=low, theta2=high, color=colour, linewidth=1.5))
    tip = place + size * np.array([np.cos(end), np.sin(end)])
    before = end - 0.35 * np.sign(end - begin) * min(1.0, abs(end - begin))
    tail = place + size * np.array([np.cos(before), np.sin(before)])
    axes.annotate("", _xy(tip), _xy(tail), arrowprops=_arrow(colour))
    if colour == LEFT:
        axes.text(place[0] - 0.06, place[1] + 0.06, text, color=colour, fontsize=9, ha="right", va="center")
        return
    middle = 0.5 * (begin + end)
    beside = place + (size + 0.1) * np.array([np.cos(middle), np.sin(middle)])
    axes.text(
        beside[0], beside[1], text, color=colour, fontsize=9, ha="left" if middle < 1.0 else "center", va="center"
    )


def _absolute(axes: Axes, at: Motion) -> None:
    _body(axes, at, "angle: absolute, from x, anticlockwise")
    angle = at.angle + ABSOLUTE_OFFSET[PITCH:]
    marks = [(TORSO, at.joint[THIGH[0]], "torso θ", TRUNK)]
    for leg, side in enumerate(("right", "left")):
        marks += [(THIGH[leg], at.joint[SHANK[leg]], f"{side} thigh", _LEGS[leg]),
                  (SHANK[leg], at.joint[FOOT[leg]], f"{side} shank", _LEGS[leg])]  # fmt: skip
    for link, place, text, colour in marks:
        axes.plot([place[0], place[0] + 0.22], [place[1]] * 2, ":", color=colour, linewidth=1.0)
        _arc(axes, place, 0.0, float(angle[link]), f"{text}\n{np.degrees(angle[link]):.0f}°", colour)
    axes.text(-0.72, -0.17, "upright: torso, thighs, shanks 90°, feet 0°", fontsize=8)


def _joints(axes: Axes, at: Motion) -> None:
    _body(axes, at, "q, v, torques: each link relative to the one above")
    leg = 0
    thigh, shank, foot = at.joint[THIGH[leg]], at.joint[SHANK[leg]], at.joint[FOOT[leg]]
    for place, text in (
        (thigh, "hip +: thigh forward"),
        (shank, "knee +: straighter\n(stop at 0, bent < 0)"),
        (foot, "ankle +: toe up"),
    ):
        _arc(axes, place, -1.3, 0.6, "", RIGHT, 0.11)
        axes.text(place[0] + 0.15, place[1] + 0.04, text, fontsize=8.5, color=RIGHT, va="center")
    top = at.com[TORSO]
    _arc(axes, top, 1.0, 2.6, "", TRUNK, 0.16)
    words = "pitch +: leans back\nx, z: the torso's\ncentre of mass"
    axes.text(top[0] - 0.2, top[1] + 0.2, words, fontsize=8.5, color=TRUNK, ha="right", va="center")
    axes.plot(*top, "o", color=TRUNK)
    axes.text(-0.72, -0.17, "upright, feet flat: all 0. A positive torque drives its angle up", fontsize=8)


def _rows(axes: Axes, at: Motion, robot: Robot) -> None:
    _body(axes, at, "rows of J: normal, then tangential")
    for i, name in enumerate(robot.points):
        colour, place = _LEGS[i // 2], at.point[i]
        axes.plot(*place, "o", color=colour, markersize=5)
        for direction, (dx, dz) in enumerate(((0.0, 0.2), (0.17, 0.0))):
            tip = place + np.array([dx, dz])
            axes.annotate("", _xy(tip), _xy(place), arrowprops=_arrow(colour))
            axes.text(tip[0] + 0.02, tip[1] + 0.02, str(2 * i + direction), fontsize=8.5, color=colour)
        axes.text(place[0], -0.07 - 0.05 * (i % 2), name.replace("_", " "), fontsize=8, color=colour, ha="center")
    for leg, stop in enumerate(robot.stops):
        place = at.joint[SHANK[leg]]
        axes.plot(*place, "s", color=_LEGS[leg], markersize=6)
        side = 1.0 if leg == 0 else -1.0
        axes.text(place[0] + 0.06 * side, place[1], f"{8 + leg}: {stop.replace('_', ' ')}'s stop", fontsize=8.5,
                  color=_LEGS[leg], va="center", ha="left" if leg == 0 else "right")  # fmt: skip
    axes.text(-0.72, -0.2, "a positive normal force pushes the foot up", fontsize=8)


if __name__ == "__main__":
    plot_conventions(PAGE)
