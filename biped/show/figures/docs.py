"""Figures of the documentation: `python -m biped.show.figures.docs NAME [PATH]` draws one of them.

`chapter3`: Figs 3.4 to 3.14 of the thesis from runs of this package, in the thesis's axes, to be laid side by side.
`contact` (docs/results.md): double support, steps and alternation over the two numbers that decide when a foot is on
the ground. `conventions` (docs/controllers.md): absolute angles, joint angles and rows of A with their signs.
`strides` (docs/pushing.md): joint angles of gaits over a stride, beside people's.
"""

from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc

from biped.ensemble.campaign import simulate, simulate_planar
from biped.ensemble.plan import Plan
from biped.measure.contact import LOADED, SPELL, feet_down, strikes_of
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.planar.topology import BASE, FOOT, HEEL, NQ, PITCH, SHANK, THIGH, TOE, TORSO, X
from biped.robot.planar.tree import ABSOLUTE_OFFSET, Motion, motion
from biped.robot.robot import Robot
from biped.scenario.keys import Scenario, Start
from biped.scenario.reading import read_scenario
from biped.show.document import DOCS
from biped.show.figures import curves, strides
from biped.show.figures.curves import strobe
from biped.show.figures.style import LEFT, QUIET, RIGHT, SETTINGS, TRUNK, figure, make_folder, save
from biped.studies.run import plan_of

STROBES = {
    "fig_3_4": "level_normal", "fig_3_5": "level_fast", "fig_3_6": "level_slow", "fig_3_7": "level_style",
    "fig_3_8": "uphill", "fig_3_9": "downhill",
}  # fmt: skip
SPEEDS = ("level_fast", "level_normal", "level_slow")
PUSHES = (
    ("push_forward", "push_backward"),
    ("push_forward_normal", "push_backward_normal"),
    ("push_forward_slow", "push_backward_slow"),
)
COLOURS = ("#B91C1C", "#111827", "#2563EB")
STEADY = 5.0
"""[s] from which the cycles of Fig 3.12 are drawn."""
TRIALS = 100


def _walk(name: str, *changes: str) -> Trajectory:
    return simulate_planar(plan_of(name, changes).run(0))


def velocities(walks: Sequence[tuple[str, Trajectory]]) -> Figure:
    """Forward velocity of the torso's centre of mass at three speeds (Fig 3.10)."""
    drawn = figure(8.0, 3.0)
    axes = drawn.add_subplot()
    for (name, t), colour in zip(walks, COLOURS, strict=True):
        axes.plot(t.time, t.v[: len(t.time), X], color=colour, linewidth=0.9, label=name)
    axes.set(xlabel="t [s]", ylabel="forward velocity [m/s]", xlim=(0.0, 10.0))
    axes.legend(fontsize=8)
    return drawn


def torsos(walks: Sequence[tuple[str, Trajectory]]) -> Figure:
    """Angle of the upper body at three speeds; 90 degrees is upright (Fig 3.11)."""
    drawn = figure(8.0, 3.0)
    axes = drawn.add_subplot()
    for (name, t), colour in zip(walks, COLOURS, strict=True):
        angle = np.degrees(t.q[: len(t.time), PITCH]) + 90.0
        axes.plot(t.time, angle, color=colour, linewidth=0.9, label=name)
    axes.set(xlabel="t [s]", ylabel="upper body angle [degrees]", xlim=(0.0, 10.0))
    axes.legend(fontsize=8)
    return drawn


def cycles(walks: Sequence[tuple[str, Trajectory]]) -> Figure:
    """Right hip, knee and ankle in the phase plane, from 5 s on (Fig 3.12)."""
    drawn = figure(9.0, 3.2)
    for panel, (axes, joint) in enumerate(zip(drawn.subplots(1, 3), ("hip", "knee", "ankle"), strict=True)):
        for (name, t), colour in zip(walks, COLOURS, strict=True):
            steady = t.time >= STEADY
            angle, rate = (np.degrees(rows[: len(t.time)][steady, BASE + panel]) for rows in (t.q, t.v))
            axes.plot(angle, rate, color=colour, linewidth=0.7, label=name)
        axes.set(xlabel=f"{joint} [degrees]", ylabel="degrees/s" if panel == 0 else "")
    return drawn


def pushed(pairs: Sequence[tuple[Trajectory, Trajectory]]) -> Figure:
    """Forward velocity in six pushes: forward red, backward black (Fig 3.13)."""
    drawn = figure(8.0, 5.4)
    for axes, pair, name in zip(drawn.subplots(3, 1), pairs, SPEEDS, strict=True):
        for t, colour in zip(pair, COLOURS, strict=False):
            axes.plot(t.time, t.v[: len(t.time), X], color=colour, linewidth=0.9)
        axes.set(ylabel="m/s", xlim=(0.0, 10.0), title=name)
    drawn.axes[-1].set_xlabel("t [s]")
    return drawn


def plot_chapter3(folder: Path) -> None:
    """Simulates the walks and draws all figures into a folder."""
    make_folder(folder)
    with matplotlib.rc_context(SETTINGS):
        for name, scenario in STROBES.items():
            save(strobe(_walk(scenario), scenario), folder / f"{name}.png")
        walks = [(name, _walk(name)) for name in SPEEDS]
        for name, draw in (("fig_3_10", velocities), ("fig_3_11", torsos), ("fig_3_12", cycles)):
            save(draw(walks), folder / f"{name}.png")
        save(pushed([(_walk(forward), _walk(backward)) for forward, backward in PUSHES]), folder / "fig_3_13.png")
        plan = plan_of(
            "thesis/model_error", ['sweep={"actuation.single_tangential"=[true]}', f"randomise.runs={TRIALS}"]
        )
        trials = [simulate_planar(plan.run(i)) for i in range(TRIALS)]
        save(curves.ensemble(trials, "M and A wrong by 10 %"), folder / "fig_3_14.png")


WALKS = {
    "whole": ("upright/own", "mujoco"), "whole, home": ("upright/own", "home"),
    "robust": ("robust/own", "mujoco"), "robust, home": ("robust/own", "home"),
    "fast": ("level_fast", "mujoco"), "fast, home": ("level_fast", "home"),
    "robot": ("robot/own", "mujoco"), "robot, home": ("robot/own", "home"),
    "human3d": ("spatial/own", "mujoco"), "h1 stands": ("any/h1", "mujoco"),
}  # fmt: skip
"""Scenario and engine of each run that is shown."""
STRIDES = {"whole": "upright/own", "gentle_robust": "upright/own", "human3d_whole": "spatial/own"}
"""Scenario of each gait whose strides are drawn."""
SHARES = np.geomspace(1e-4, 0.3, 36)
"""Of the weight."""
SPELLS = np.arange(0.0, 0.151, 0.005)
"""[s]."""
START = 3.0
"""[s] from which runs are counted, or from their middle."""


def counted(t: Trajectory, share: float, spell: float) -> tuple[float, int, float]:
    """Double support, steps and alternation of the latter part of a run by some threshold and shortest spell."""
    down = feet_down(t.foot_force, t.mass * GRAVITY, t.tick, share, spell)
    first = int(np.searchsorted(t.time, min(START, 0.5 * t.time[-1])))
    feet = [foot for row, foot in strikes_of(down, t.tick, spell) if row >= first]
    alternation = float(np.mean(np.diff(feet) != 0)) if len(feet) > 1 else np.nan
    return float(down[first:].all(axis=1).mean()), len(feet), alternation


def plot_contact(path: Path) -> None:
    """Draws them against the threshold at the shortest spell that counts, and the other way round, into a PNG file."""
    runs = {
        name: simulate(Plan(read_scenario(scenario, [f"engine={engine}"])).run(0))
        for name, (scenario, engine) in WALKS.items()
    }
    with matplotlib.rc_context(SETTINGS):
        page = figure(10.0, 8.4)
        axes = page.subplots(3, 2, sharex="col", sharey="row")
        for column, (marks, chosen) in enumerate(((SHARES, LOADED), (1e3 * SPELLS, 1e3 * SPELL))):
            for i, (name, t) in enumerate(runs.items()):
                numbers = np.array(
                    [counted(t, mark, SPELL) if column == 0 else counted(t, LOADED, 1e-3 * mark) for mark in marks]
                )
                line = "--" if name.endswith("home") else "-"
                for row in range(3):
                    axes[row, column].plot(marks, numbers[:, row], line, color=f"C{i // 2 if i < 8 else i - 4}",
                                           label=name, lw=1.1)  # fmt: skip
            for row in range(3):
                axes[row, column].axvline(chosen, color="k", lw=0.8, ls=":")
        axes[0, 0].set_xscale("log")
        axes[0, 0].set_xticks([1e-4, 1e-3, 1e-2, 1e-1], ["0.01 %", "0.1 %", "1 %", "10 %"])
        axes[1, 0].set_yscale("symlog", linthresh=20)
        axes[1, 0].set_yticks([0, 10, 20, 100, 1000], ["0", "10", "20", "100", "1000"])
        axes[1, 0].set_ylim(-1.0, 2000.0)
        axes[2, 0].set_xlabel(f"force / weight from which a foot is loaded, at {1e3 * SPELL:.0f} ms")
        axes[2, 1].set_xlabel(f"shortest swing and contact [ms], at {100 * LOADED:g} % of the weight")
        for row, name in enumerate(("double support", "foot strikes", "alternation")):
            axes[row, 0].set_ylabel(name)
        axes[0, 1].legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        save(page, path)


_LEGS = (RIGHT, LEFT)
_HEAD = 0.55
"""[m] drawn of the trunk above the torso's centre of mass."""


def plot_conventions(path: Path) -> None:
    """Draws the human in a step, its angles and its rows of A, into a PNG file."""
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
        save(page, path)


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


def plot_strides(path: Path) -> None:
    """Draws hip, knee and ankle of gaits over a stride, beside people's."""
    walks = {gait: simulate(plan_of(name, [f"controller={gait}"]).run(0)) for gait, name in STRIDES.items()}
    with matplotlib.rc_context(SETTINGS):
        drawn = strides.draw(walks, "In the plane, and in space", (4.0, 10.0))
        assert drawn is not None
        save(drawn, path)


FIGURES = {
    "chapter3": (plot_chapter3, "chapter3"), "contact": (plot_contact, "contact.png"),
    "conventions": (plot_conventions, "conventions.png"), "strides": (plot_strides, "strides.png"),
}  # fmt: skip
"""How each is drawn, and its place in docs/figures/."""


if __name__ == "__main__":
    parser = ArgumentParser(prog="python -m biped.show.figures.docs", description="Draws a figure of the docs.")
    parser.add_argument("figure", choices=sorted(FIGURES))
    parser.add_argument("out", type=Path, nargs="?", help="file or folder (default: its place in docs/figures/)")
    wanted = parser.parse_args()
    plot, place = FIGURES[wanted.figure]
    plot(wanted.out or DOCS / "figures" / place)
