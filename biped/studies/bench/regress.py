"""The benchmark that guards: it fails when a result changed, and says when a tick got slower.

Costs are ratios to bare `mj_step` in the same process, so that they mean the same on a busy or a slow machine; yet they
are measurements, and a slow one is no failure.
"""

from datetime import date
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from biped.base import platform
from biped.ensemble.campaign import simulate
from biped.studies.bench.throughput import tick_costs
from biped.studies.regress.references import RecordedScenario, TickCost, digest, read, shipped, write
from biped.studies.run import plan_of, title_of

SCENARIOS = ("level_normal", "level_normal_generalized", "robust/own")
"""Joint torques, none, and one tangential row per foot."""
SLOWER = 0.25
"""Relative increase of a cost that is reported."""

SAME, CHANGED, ELSEWHERE, UNKNOWN = "same", "CHANGED", "recorded on another platform", "no reference"


class Timed(NamedTuple):
    """One scenario, timed.

    Attributes:
        scenario: Its name.
        result: What became of its result.
        old: Recorded cost; None if there is none.
        new: Measured cost.
        slower: Relative change of the closed loop's cost, or of that with metrics if that is more; 0 without a record.
    """

    scenario: str
    result: str
    old: TickCost | None
    new: TickCost
    slower: float


def judged(
    name: str, reference: RecordedScenario | None, old: TickCost | None, new: TickCost, bits: str, here: str
) -> Timed:
    """Compares result and cost of a scenario with what was recorded.

    Args:
        name: The scenario.
        reference: Its reference; its first run is the scenario itself.
        old: Its recorded cost.
        new: Its cost now.
        bits: Digest of the timed run.
        here: Key of this platform.
    """
    if reference is None:
        result = UNKNOWN
    elif reference.platform != here:
        result = ELSEWHERE
    else:
        result = SAME if reference.digests[0] == bits else CHANGED
    slower = 0.0 if old is None else max(new.loop / old.loop, new.metrics / old.metrics) - 1.0
    return Timed(name, result, old, new, slower)


class Guarded(NamedTuple):
    """Results and costs beside what was recorded.

    Attributes:
        timed: By scenario.
    """

    timed: list[Timed]

    @property
    def passed(self) -> bool:
        """Whether all results are as recorded, where that can be told."""
        return all(one.result in (SAME, ELSEWHERE) for one in self.timed)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, as `--json` prints it."""
        return {"passed": self.passed, "scenarios": [msgspec.to_builtins(one._asdict()) for one in self.timed]}


def guard(file: Path | None = None, reason: str | None = None) -> Guarded:
    """Times scenarios and compares with what was recorded.

    Args:
        file: File of references; default: that of the shipped scenarios.
        reason: Why costs changed: records them. Results are recorded by `biped regress --update`.
    """
    path = shipped() if file is None else file
    references = read(path)
    here = platform.key(platform.here())
    timed = []
    for name in SCENARIOS:
        costs = tick_costs(name)
        new = TickCost(date.today().isoformat(), reason or "", *(round(costs[f"ratio_{part}"], 2) for part in
                                                            ("loop", "with_metrics")))  # fmt: skip
        bits = digest(simulate(plan_of(name, ()).run(0)))
        title = title_of(name)
        timed.append(judged(title, references.scenarios.get(title), references.costs.get(title), new, bits, here))
    if reason is not None:
        references.costs |= {one.scenario: one.new for one in timed}
        write(path, references)
    return Guarded(timed)
