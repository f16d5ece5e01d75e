"""The price of the sentinels: `python -m tests.lies.cost` runs with and without them by turns, in one process.

Without means: a law is not watched, and momentum and places are not judged. What is written in a tick for them, an
angular momentum, is written in both; it is timed by itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from unittest import mock

import numpy as np

from biped.base.trust import grant
from biped.engines.untouched import Untouched
from biped.ensemble.campaign import run_one
from biped.measure import metrics
from biped.measure.momentum import Mean, Unexplained
from biped.studies.planned import plan_of
from tests.lies.inside import law_with
from tests.lies.judge import _folder, _stands

TURNS = 15
NOTHING = Unexplained(*[(Mean(0.0, 0.0, 0.0, ""), Mean(0.0, 0.0, 0.0, ""))] * 3)
LAW = "self.ticks = 1"
"""In the place of a line that changes the simulator."""


def _cases() -> dict[str, tuple[str, list[str]]]:
    path = _folder() / "law.py"
    path.write_text(law_with("time").replace("data.time += 1.0", LAW), encoding="utf-8")
    grant(path)
    seconds = ["duration=4.0", "window.start=1.0", "window.end=4.0", "randomise.runs=1", "randomise.draw={}"]
    return {
        "calm/own, seven links": ("calm/own", seconds),
        "spatial/own": ("spatial/own", seconds),
        "h1, the law that stands": (_stands("h1", "h1"), seconds[:3]),
        "h1, a law of its user": (_stands("h1", "h1"), [*seconds[:3], f"law={path}:Law"]),
    }


def _timed(run: Callable[[], object], watched: bool) -> float:
    with ExitStack() as stack:
        if not watched:
            stack.enter_context(mock.patch.object(metrics, "unexplained", return_value=NOTHING))
            stack.enter_context(mock.patch.object(Untouched, "before", return_value=False))
            stack.enter_context(mock.patch.object(Untouched, "found", return_value={}))
        start = time.process_time()
        run()
        return time.process_time() - start


def main() -> None:
    """Prints the ratio of the times with and without, turn by turn: its median, and the middle half of the turns."""
    for name, (scenario, changes) in _cases().items():
        plan = plan_of(scenario, changes)

        def run(plan=plan):
            return run_one(plan, 0)

        ticks = len(run()[0])
        pairs = np.array([[_timed(run, watched) for watched in (True, False)] for _ in range(TURNS)])
        low, middle, high = np.percentile(pairs[:, 0] / pairs[:, 1], (25, 50, 75))
        each = 1e6 * np.median(pairs[:, 1]) / ticks
        print(f"{name}: {middle:.4f} ({low:.4f} – {high:.4f}) of {each:.1f} us a tick, {ticks} ticks")


if __name__ == "__main__":
    main()
