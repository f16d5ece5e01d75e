"""The price of the sentinels: `python -m tests.lies.cost` times them and the runs that they judge, in one process.

Each is the least CPU time of several, which other work on the machine disturbs least: what judges momentum and places
after a run, what watches a law at its ticks, and the run itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from biped.base.trust import grant
from biped.engines.plant import MujocoPlant
from biped.engines.untouched import Untouched
from biped.ensemble.campaign import run_one
from biped.measure.momentum import unexplained
from biped.studies.run import plan_of
from tests.lies.inside import LAWS, law_with
from tests.lies.judge import _folder, _stands

TURNS = 7
SECONDS = ["duration=2.0", "window.start=1.0", "window.end=2.0"]


def _cases() -> dict[str, tuple[str, list[str]]]:
    path = _folder() / "law.py"
    path.write_text(law_with("time").replace(LAWS["time"], "columns.sort()"), encoding="utf-8")
    grant(path)
    one = ["randomise.runs=1", "randomise.draw={}"]
    return {
        "calm/own, seven links": ("calm/own", [*SECONDS, *one]),
        "spatial/own": ("spatial/own", [*SECONDS, *one]),
        "h1, the law that stands": (_stands("h1", "h1"), SECONDS),
        "h1, a law in Python": (_stands("h1", "h1"), [*SECONDS, f"law={path}:Law"]),
    }


def _least(run: Callable[[], object]) -> float:
    """[s] of CPU, the least of `TURNS`."""
    out = []
    for _ in range(TURNS):
        start = time.process_time()
        run()
        out.append(time.process_time() - start)
    return min(out)


def _watching(watch: Untouched, ticks: int) -> None:
    for k in range(ticks):
        if watch.before(k):
            watch.after()


def main() -> None:
    """Prints what a run takes, and the share of it that judging and watching take."""
    for name, (scenario, changes) in _cases().items():
        plan = plan_of(scenario, changes)
        t, _ = run_one(plan, 0)
        whole, judged = _least(lambda plan=plan: run_one(plan, 0)), _least(lambda t=t: unexplained(t))
        watched = 0.0
        if any(change.startswith("law=") for change in changes):
            plant = MujocoPlant(plan.run(0))
            ticks = len(t)

            def watch(plant=plant, ticks=ticks):
                _watching(Untouched(plant.model, plant.data, True), ticks)

            watched = _least(watch)
        each = 1e6 * whole / len(t)
        print(f"{name}: {each:.1f} us a tick, {len(t)} ticks; momentum and places {judged / whole:.2%}, "
              f"the watch {watched / whole:.2%} of it", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
