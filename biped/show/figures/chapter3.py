"""Figures 3.4 to 3.14 of the thesis from runs of this package, in the thesis's axes: they can be laid side by side.

`python -m biped.show.figures.chapter3 [FOLDER]` simulates and draws them (default: docs/figures/chapter3).
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from biped.ensemble.campaign import simulate_planar
from biped.measure.trajectory import Trajectory
from biped.robot.planar.topology import BASE, PITCH, X
from biped.show.figures import curves
from biped.show.figures.curves import strobe
from biped.show.figures.style import SETTINGS, figure, make_folder, save
from biped.studies.run import plan_of

FOLDER = Path(__file__).parents[3] / "docs" / "figures" / "chapter3"
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


def main(argv: Sequence[str]) -> None:
    """Draws all figures into a folder."""
    folder = Path(argv[0]) if argv else FOLDER
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


if __name__ == "__main__":
    main(sys.argv[1:])
