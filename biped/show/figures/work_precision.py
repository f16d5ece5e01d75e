"""Log–log figures of error against CPU time and against step."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt

if TYPE_CHECKING:
    from biped.studies.bench.mechanisms import Point


def draw(points: "Sequence[Point]", folder: Path) -> None:
    """One PNG a problem: `work_precision_<problem>.png`."""
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
