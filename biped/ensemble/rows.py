"""A run's numbers as a record: what is computed with has names, types and units; results and journals hold its JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import msgspec

from biped.measure.metrics.walking import apart
from biped.measure.verdict import SOUND
from biped.scenario.metrics import METRICS, Metric

NAN = math.nan


FLAGS = ("walked", "diverged", "doubtful")
"""Counts that are true or false of a single run."""


class RowHead(msgspec.Struct, frozen=True, kw_only=True):
    """The part of a run's row that says which run it was and how it ended.

    Attributes:
        index: Number in the campaign.
        seed: Its own seed.
        values: What its point of the sweep and its draws changed, by key.
        fell: Whether it fell, or its numbers diverged.
        end: `completed`, `fell`, `diverged` (its numbers were not finite any more), `RAISED`, or `LOST`.
        cause: How it ended, in words; empty if completed.
        verdict: On its numbers: `sound`, `doubtful` or `diverged` (`biped.measure.verdict`).
        doubt: Which sentinels failed; empty of sound numbers.
    """

    index: int
    seed: int
    values: dict[str, Any]
    fell: bool
    end: str
    cause: str
    verdict: str = SOUND
    doubt: str = ""


def _field(metric: Metric) -> tuple[str, type, Any]:
    """Name, type and default of a metric's field."""
    kind = float if metric.kind == "mean" else bool if metric.name in FLAGS else int
    return metric.name, kind, NAN if kind is float else kind()


if TYPE_CHECKING:

    class RowMetrics(RowHead, frozen=True, kw_only=True):
        """A row with a field for every metric of one run."""

        walked: bool = False
        stood: int = 0
        time: float = NAN

        def __getattr__(self, name: str) -> Any: ...

else:
    RowMetrics = msgspec.defstruct(
        "RowMetrics",
        [_field(metric) for metric in METRICS.values() if metric.name != "falls"],
        bases=(RowHead,),
        frozen=True,
        kw_only=True,
    )


class Row(RowMetrics, frozen=True, kw_only=True):
    """One run: which it was, how it ended, and every metric of `METRICS` but `falls`; nan where it does not exist.

    Attributes:
        leg_states: Commonest `cycle` of leg states and its `share`; None for a run that ended before the window.
        per_joint: Peak and mean torque [N m] and peak power [W] of hip, knee and ankle; likewise.
        signals: Mean, smallest and largest in the window of what a law of the user's own logged, by name.
        warnings: The engine's, name to count.
    """

    leg_states: dict[str, Any] | None = None
    per_joint: dict[str, dict[str, float]] | None = None
    signals: dict[str, dict[str, float]] | None = None
    warnings: dict[str, int] = msgspec.field(default_factory=dict)

    @property
    def lost(self) -> bool:
        """Whether nobody knows what became of it."""
        return self.end == LOST

    def as_dict(self) -> dict[str, Any]:
        """As in result.json: keys in order, what a run has none of left out."""
        fields = {name: getattr(self, name) for name in self.__struct_fields__}
        return {name: value for name, value in fields.items() if value is not None}

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> Row:
        """The row that `as_dict` gave a record of; rows of versions before are brought up to date."""
        record = apart(record)
        return cls(**{name: record[name] for name in cls.__struct_fields__ if name in record})


RAISED = "raised"
"""How a run ended whose law, the user's own, failed: it neither walked nor fell."""
LOST = "lost"
"""How a run ended that cost two workers: it neither walked nor fell, its numbers are nan."""
