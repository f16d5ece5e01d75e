"""The result object of a scenario, which `--json` prints, and the table of its runs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biped.base.statistics import wilson
from biped.ensemble.checks import Check, judge, passed
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.plan import Plan
from biped.ensemble.rows import Row
from biped.ensemble.sweeps import by_point, thresholds
from biped.measure.metrics.totals import Totals
from biped.scenario.metrics import METRICS

if TYPE_CHECKING:
    import pyarrow


def result_of(name: str, plan: Plan, rows: Sequence[Row] | StoredRows) -> dict[str, Any]:
    """The result object of a scenario: verdict, checks, summary, runs.

    Whether it passes is `biped.ensemble.checks.passed`: null if nothing was expected, or if a check is undecided.

    Args:
        name: Of the scenario.
        plan: Its runs.
        rows: What came of them, in their order; those of a large campaign stay where they are.
    """
    runs = rows if isinstance(rows, StoredRows) else [row.as_dict() for row in rows]
    totals = Totals()
    for columns in batches(runs, tuple(METRICS)):
        totals.add(columns)
    summary = totals.numbers
    checks: list[Check] = judge(plan.scenario.expect, summary, runs)
    low, high = wilson(int(summary["walked"]), len(rows))
    points = by_point(plan.scenario, runs) if plan.scenario.sweep else []
    swept = {"points": points, "thresholds": thresholds(plan.scenario, points)} if points else {}
    return {
        "scenario": name,
        "engine": plan.scenario.engine,
        "passed": passed(checks),
        "summary": {name: summary[name] for name in METRICS} | {"runs": len(rows), "walked_interval": [low, high]},
        "thesis": plan.scenario.thesis,
        "runs": runs,
        "checks": [check._asdict() for check in checks],
        **swept,
    }


def without_rows(result: Mapping[str, Any]) -> dict[str, Any]:
    """A result as result.json and `--json` tell it: the rows of a large campaign lie in files of their own."""
    return {key: value for key, value in result.items() if not isinstance(value, StoredRows)}


def table_of(rows: Sequence[Mapping[str, Any]]) -> pyarrow.Table:
    """Rows as an Arrow table: one flat row each; what a row lacks is null."""
    import pyarrow

    flat = [_flat(row) for row in rows]
    names = list(dict.fromkeys(name for row in flat for name in row))
    return pyarrow.table({name: [row.get(name) for row in flat] for name in names})


def write_table(path: Path, rows: Sequence[Row]) -> None:
    """Writes runs.parquet, one flat row per run."""
    import pyarrow.parquet

    pyarrow.parquet.write_table(table_of([row.as_dict() for row in rows]), path)


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, dict):
            if key == "warnings":
                flat[key] = json.dumps(value, sort_keys=True)
            else:
                flat |= {f"{key}.{inner}": item for inner, item in _flat(value).items()}
        else:
            flat[key] = value
    return flat
