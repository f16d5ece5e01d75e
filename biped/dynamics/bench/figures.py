"""Figures of the benches: error against CPU time, step and tolerance; Figs 4.7 and 4.8."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biped.dynamics.bench.experiments import Experiments
from biped.dynamics.bench.followed import Followed
from biped.dynamics.bench.mechanisms import TimedRun
from biped.dynamics.bench.swings import Swing
from biped.dynamics.bench.tolerances import AdaptiveRun

_JOINTS = {"hip": "#0072B2", "knee": "#E69F00", "ankle": "#009E73"}
_QUIET = "#9AA3AD"
_LINES = (("#0072B2", "-"), ("#D55E00", "--"), (_QUIET, ":"), ("#6B7280", "-."))
"""Colours that the colour-blind can tell apart, and dashes."""
_SHOWN = 8.0 / 3.0
"""[s] of the moving references, at the end, where the response is steady."""


def draw_work_precision(points: Sequence[TimedRun], folder: Path) -> None:
    """Draws one PNG a problem: `work_precision_<problem>.png`."""
    folder.mkdir(parents=True, exist_ok=True)
    for problem in dict.fromkeys(p.problem for p in points):
        here = [p for p in points if p.problem == problem and p.error and p.cpu and p.error < 3.0]
        figure, (work, step) = plt.subplots(1, 2, figsize=(11, 4.8), sharey=True, layout="constrained")
        for k, method in enumerate(dict.fromkeys(p.method for p in here)):
            runs = [p for p in here if p.method == method]
            mine = runs[0].method.startswith(("Euler", "RK"))
            style = {
                "marker": "osD^v<>phX*P"[k % 12],
                "color": f"C{k % 10}",
                "ls": "-" if mine else "--",
                "ms": 5,
                "lw": 2 if runs[0].ours else 1,
            }
            work.loglog([1e3 * p.cpu for p in runs if p.cpu], [p.error for p in runs], label=method, **style)
            if "adaptive" not in method and "IDA" not in method:
                step.loglog([p.setting for p in runs], [p.error for p in runs], **style)
        work.set(xlabel="CPU time [ms]", ylabel="largest error", title=problem)
        step.set(xlabel="step [s]", title="the same runs against the step")
        for axes in (work, step):
            axes.grid(True, which="major", alpha=0.3)
        figure.legend(loc="outside right center", fontsize=8)
        name = problem.replace(" ", "_").replace("'", "")
        figure.savefig(folder / f"work_precision_{name}.png", dpi=90)
        plt.close(figure)


def draw_tolerances(reached: Sequence[AdaptiveRun], folder: Path) -> None:
    """Draws one PNG, `tolerances.png`; a run that ended with an error is a cross at the top."""
    figure, axes = plt.subplots(figsize=(9.5, 5.2), layout="constrained")
    tolerances = [r.tolerance for r in reached]
    low, high = min(tolerances), max(tolerances)
    axes.loglog([low, high], [low, high], "k:", lw=1, label="error = tolerance")
    for k, problem in enumerate(dict.fromkeys(r.problem for r in reached)):
        runs = [r for r in reached if r.problem == problem]
        done = [r for r in runs if r.error]
        style = {"color": f"C{k % 10}", "ls": "-" if k < 10 else "--", "marker": "osD^v<>phX*P"[k % 12], "ms": 4}
        axes.loglog([r.tolerance for r in done], [r.error for r in done if r.error], label=problem, **style)
        ended = [r.tolerance for r in runs if r.error is None]
        axes.loglog(ended, [1.0] * len(ended), "x", color=f"C{k % 10}")
    axes.set(xlabel="tolerance of a step", ylabel="largest error [m, rad or J]")
    axes.grid(True, which="major", alpha=0.3)
    figure.legend(loc="outside right center", fontsize=8)
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "tolerances.png", dpi=90)
    plt.close(figure)


def draw_experiments(report: Experiments, folder: Path) -> None:
    """Draws `fig_4_7.png` and `fig_4_8.png`."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in {"fig_4_7": _swings(report.swings), "fig_4_8": _followed(report.followed)}.items():
        figure.savefig(folder / f"{name}.png", dpi=110)
        plt.close(figure)


def _swings(swings: tuple[Swing, ...]) -> Figure:
    figure, panels = plt.subplots(1, 2, figsize=(9.0, 3.8), layout="constrained")
    for axes, joint in zip(panels, ("hip", "knee"), strict=True):
        mine = [swing for swing in swings if swing.joint == joint]
        for swing, (colour, dashes) in zip(mine, _LINES, strict=False):
            axes.plot(swing.time, np.degrees(swing.angle), dashes, color=colour, label=swing.reading.name)
        _label(axes, f"{joint} swings freely")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8)
    return figure


def _followed(followed: Followed) -> Figure:
    figure, panels = plt.subplots(3, 1, figsize=(9.0, 6.0), sharex=True, layout="constrained")
    rows = followed.time > followed.time[-1] - _SHOWN
    time = followed.time[rows] - followed.time[rows][0]
    for i, (axes, joint) in enumerate(zip(panels, _JOINTS, strict=True)):
        axes.plot(time, np.degrees(followed.reference[rows, i]), "--", color=_QUIET, label="reference")
        axes.plot(time, np.degrees(followed.angle[rows, i]), color=_JOINTS[joint], label="model")
        steady = followed.steady[i]
        _label(axes, f"{joint}: {steady.amplitude:.1f} degrees, {steady.lag:.0f} behind")
        axes.legend(loc="upper right", ncols=2, fontsize=8)
    return figure


def _label(axes: Axes, title: str) -> None:
    axes.set(title=title, ylabel="degrees", xlabel="time [s]")
    axes.grid(True, alpha=0.3)
