"""Double support, steps and alternation over the two numbers that decide when a foot is on the ground.

`python -m biped.show.figures.contact` writes the figure of docs/results.md.
"""

from pathlib import Path

import matplotlib
import numpy as np

from biped.base.files import folder
from biped.ensemble.campaign import simulate
from biped.ensemble.plan import Plan
from biped.measure.contact import LOADED, SPELL, feet_down, strikes_of
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY
from biped.scenario.reading import read_scenario
from biped.show.figures.style import SETTINGS, figure, save

PAGE = folder("models").parent / "docs" / "figures" / "contact.png"
WALKS = {
    "whole": ("upright/own", "mujoco"), "whole, home": ("upright/own", "home"),
    "robust": ("robust/own", "mujoco"), "robust, home": ("robust/own", "home"),
    "fast": ("level_fast", "mujoco"), "fast, home": ("level_fast", "home"),
    "robot": ("robot/own", "mujoco"), "robot, home": ("robot/own", "home"),
    "human3d": ("spatial/own", "mujoco"), "h1 stands": ("any/h1", "mujoco"),
}  # fmt: skip
"""Scenario and engine of each run that is shown."""
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


def plot_contact(runs: dict[str, Trajectory], path: Path) -> Path:
    """Draws them against the threshold at the shortest spell that counts, and the other way round.

    Args:
        runs: By what they are called.
        path: The PNG file.

    Raises:
        InputError: The file cannot be written.
    """
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
        return save(page, path)


if __name__ == "__main__":
    plot_contact(
        {name: simulate(Plan(read_scenario(scenario, [f"engine={engine}"])).run(0))
         for name, (scenario, engine) in WALKS.items()}, PAGE,
    )  # fmt: skip
