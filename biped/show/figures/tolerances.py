"""Error of adaptive steps against their tolerance."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt

if TYPE_CHECKING:
    from biped.studies.bench.tolerances import Reached


def draw(reached: "Sequence[Reached]", folder: Path) -> None:
    """One PNG, `tolerances.png`; a run that ended with an error is a cross at the top."""
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
