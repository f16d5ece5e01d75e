"""What is run of a scenario: a fixed, seeded part of it that is quick and still tells one gait from another.

Every scenario gets two minutes of walking: at most twelve runs. Of a campaign they are spread evenly over the points of
its sweep. A scenario of one run is one start of a chaotic system: where bits differ, even its fall says nothing. It
becomes an ensemble: run 0 is the scenario itself, the others start up to a few milliradians beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from hashlib import blake2b
from typing import TYPE_CHECKING

import msgspec

from biped.ensemble import campaign
from biped.ensemble.backend import Jobs, at_most
from biped.ensemble.executor import workers
from biped.ensemble.plan import Plan
from biped.ensemble.rows import RAISED, Row
from biped.scenario.randomise import Distribution
from biped.studies.regress.references import METRICS, RecordedScenario

if TYPE_CHECKING:
    from biped.measure.stored import AnyTrajectory

SECONDS = 120.0
"""Most seconds of walking per scenario."""
MOST = 12
"""Most runs per scenario."""
JITTER = 0.002
"""[rad], std of the starts of a scenario that has one start: as in the thesis's programme here."""


def ensemble(plan: Plan) -> Plan:
    """The plan itself if it is one of many runs; otherwise many starts of its run, the first its own."""
    if len(plan) > 1:
        return plan
    s = plan.scenario
    random = msgspec.structs.replace(s.randomise, runs=MOST)
    if s.start.jitter == 0.0 and "start.jitter" not in random.draw:
        starts = Distribution(grid=(0.0, *(JITTER,) * (MOST - 1)))
        random = msgspec.structs.replace(random, draw=random.draw | {"start.jitter": starts})
    return Plan(msgspec.structs.replace(s, randomise=random), plan.origin)


def chosen(plan: Plan) -> list[int]:
    """Numbers of the runs to make: spread over the points of the sweep, at each the first of its ensemble in turn."""
    count = max(1, min(MOST, int(SECONDS / plan.scenario.duration), len(plan)))
    points, runs = len(plan.points), plan.scenario.randomise.runs
    return sorted(i * points // count * runs + i % runs for i in range(count))


def measured(plan: Plan, jobs: Jobs, date: str, platform: str, advance: Callable[[], None]) -> RecordedScenario:
    """Makes the chosen runs of an `ensemble`.

    Args:
        plan: The ensemble.
        jobs: Number of processes, or a cluster.
        date: Of today.
        platform: Key of this platform.
        advance: Called after every run.
    """
    numbers = chosen(plan)
    rows, digests = [], []
    with workers(partial(_made, plan), at_most(jobs, len(numbers))) as made:
        for row, name in made(numbers):
            rows.append(row)
            digests.append(name)
            advance()
    return RecordedScenario(
        since=date,
        platform=platform,
        runs=numbers,
        ends="".join(_letter(row) for row in rows),
        digests=digests,
        **{name: [_rounded(getattr(row, name)) for row in rows] for name in METRICS},
    )


def digest(trajectory: AnyTrajectory) -> str:
    """A name for the bits of a run's log."""
    return blake2b(trajectory.log.tobytes(), digest_size=6).hexdigest()


def _made(plan: Plan, index: int) -> tuple[Row, str]:
    trajectory, row = campaign.run_one(plan, index)
    return row, digest(trajectory)


def _letter(row: Row) -> str:
    if row.diverged:
        return "d"
    if row.doubtful:
        return {"completed": "?", "fell": "F"}.get(row.end, "!")
    return "w" if row.walked else {"completed": "s", "fell": "f", RAISED: "!"}[row.end]


def _rounded(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None
