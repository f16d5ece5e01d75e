"""A run's numbers as a record: what is computed with has names, types and units; results and journals hold its JSON.

Rows of a large campaign are an Arrow table whose columns the scenario alone decides: any two pieces of a campaign fit
together. A number that does not exist is null, as in result.json. What a point of the sweep and the draws changed is
`values.<key>`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, get_type_hints

import msgspec
import numpy as np

from biped.base.writing import dumps
from biped.measure.metrics.walking import apart
from biped.measure.verdict import SOUND
from biped.scenario.keys import Scenario
from biped.scenario.metrics import METRICS, Metric
from biped.scenario.vary import DRAW, lookup

if TYPE_CHECKING:
    import pyarrow

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


WHOLE = ("index", "seed", "stood", "steps")
"""Columns of whole numbers; those of a type of its own follow from the row's."""
JOINTS = ("hip", "knee", "ankle")
LOADS = ("peak_torque", "mean_torque", "peak_power")
NESTED = {
    "leg_states": ("leg_states.cycle", "leg_states.share"),
    "per_joint": tuple(f"per_joint.{joint}.{load}" for joint in JOINTS for load in LOADS),
    "signals": ("signals",),
    "warnings": ("warnings",),
}
"""Tables of a row that become columns, and the names of those columns."""
AS_JSON = ("warnings", "signals")
"""Those whose keys nobody knows beforehand: JSON."""
JSON = b"json"
"""Mark of a column whose values are JSON: a key that takes numbers and words."""


def schema_of(scenario: Scenario, metadata: dict[str, str] | None = None) -> pyarrow.Schema:
    """The columns of a campaign's rows.

    Args:
        scenario: An effective one.
        metadata: What the schema says besides.
    """
    import pyarrow as pa

    kinds = {bool: pa.bool_(), str: pa.string(), int: pa.int64(), float: pa.float64()}
    fields = []
    for name, kind in get_type_hints(Row).items():
        if name == "values":
            for key, varied in _varied(scenario).items():
                told = {JSON: b"1"} if varied is None else None
                fields.append(pa.field(f"values.{key}", pa.string() if varied is None else varied, metadata=told))
        elif name in NESTED:
            words = ("leg_states.cycle", *AS_JSON)
            fields += [pa.field(inner, pa.string() if inner in words else pa.float64()) for inner in NESTED[name]]
        else:
            fields.append(pa.field(name, pa.int64() if name in WHOLE else kinds[kind]))
    return pa.schema(fields, metadata=metadata)


def table(rows: Sequence[Row], schema: pyarrow.Schema) -> pyarrow.Table:
    """Rows as a table."""
    import pyarrow as pa

    arrays = []
    for field in schema:
        values = [_cell(row, field.name) for row in rows]
        if pa.types.is_floating(field.type):
            numbers = np.array(values, dtype=float)  # None is nan
            arrays.append(pa.array(numbers, field.type, mask=~np.isfinite(numbers)))
            continue
        if field.name in WHOLE:
            values = [value if isinstance(value, int) else None for value in values]
        elif JSON in (field.metadata or {}):
            values = [json.dumps(value) for value in values]
        arrays.append(pa.array(values, field.type))
    return pa.Table.from_arrays(arrays, schema=schema)


def _cell(row: Row, name: str) -> Any:
    """The value of a row in a column."""
    first, _, rest = name.partition(".")
    value = getattr(row, first)
    if first in AS_JSON:
        return None if value is None else dumps(dict(sorted(value.items())))
    if first == "values":
        return value[rest]
    for part in rest.split(".") if rest else ():
        value = None if value is None else value[part]
    return value


def records(rows: pyarrow.Table | pyarrow.RecordBatch) -> Iterator[dict[str, Any]]:
    """Rows of a table as `Row.as_dict` gives them."""
    text = {field.name for field in rows.schema if JSON in (field.metadata or {})}
    for flat in rows.to_pylist():
        record: dict[str, Any] = {}
        for name, value in flat.items():
            *outer, last = name.split(".", 1) if name.startswith("values.") else name.split(".")
            if name in AS_JSON:
                if value is not None:
                    record[name] = json.loads(value)
            elif not outer:
                record[name] = math.nan if value is None else value
            else:
                at = record
                for part in outer:
                    at = at.setdefault(part, {})
                at[last] = json.loads(value) if name in text else value
        for name in ("leg_states", "per_joint"):
            if not _any(record.get(name)):
                record.pop(name, None)
        yield Row.of({"values": {}, **record}).as_dict()


def _any(value: Any) -> bool:
    """Whether a nested table holds anything."""
    return any(map(_any, value.values())) if isinstance(value, dict) else value is not None


def _varied(scenario: Scenario) -> dict[str, pyarrow.DataType | None]:
    """The type of every key that varies; None: of several."""
    import pyarrow as pa

    found: dict[str, Any] = {key: _kind(values) for key, values in scenario.sweep.items()}
    for key, distribution in scenario.randomise.draw.items():
        named = distribution.grid if distribution.grid is not None else distribution.choice
        if named is not None:
            kind = _kind(named)
        else:
            kind = pa.list_(pa.float64()) if isinstance(lookup(scenario, key, DRAW), tuple) else pa.float64()
        found[key] = kind
    return found


def _kind(values: Sequence[Any]) -> pyarrow.DataType | None:
    """The type that all values have; None if they have several."""
    import pyarrow as pa

    kinds = {bool: pa.bool_(), str: pa.string(), float: pa.float64()}
    (kind, *others) = {type(value) for value in values}
    return None if others else kinds[kind]
