"""The result object of a scenario, which `--json` prints, and the table of its runs.

Of a sweep it has success at every point with its interval, and thresholds below which everything holds.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biped.base.statistics import enough_for, wilson
from biped.ensemble.checks import Check, goal_among, judge, passed
from biped.ensemble.columns import StoredRows, batches
from biped.ensemble.plan import Plan
from biped.ensemble.rows import Row
from biped.measure.metrics import Totals
from biped.scenario.keys import Scenario
from biped.scenario.metrics import HEAD, METRICS
from biped.scenario.vary import points_of

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


def by_point(scenario: Scenario, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One record per point of the sweep.

    Args:
        scenario: The campaign's scenario.
        rows: Rows of its runs, in the order of their numbers; points without rows are left out.

    Returns:
        `values` (key to value), `runs`, `goal` (the metric that says what runs had to do; how many reached it stands
        under its name), `walked`, `falls`, `doubtful`, `rate` of the goal and its `interval` (Wilson, 95 %), and the
        metrics of `HEAD` (means over the runs that walked).
    """
    out: list[dict[str, Any]] = []
    points, runs = points_of(scenario), scenario.randomise.runs
    goal = goal_among(scenario.expect)
    asked = tuple(dict.fromkeys((goal, "walked", "falls", "doubtful", *HEAD)))
    at, totals = 0, Totals(asked)

    def close() -> None:
        if totals.runs:
            out.append(_record(points[at], totals, goal))

    for columns in batches(rows, ("index", *asked)):
        point = columns["index"] // runs
        starts = np.flatnonzero(np.diff(point, prepend=-1))
        for first, last in pairwise((*starts, point.size)):
            if point[first] != at:
                close()
                at, totals = int(point[first]), Totals(asked)
            totals.add({name: values[first:last] for name, values in columns.items()})
    close()
    return out


def _record(values: dict[str, Any], totals: Totals, goal: str) -> dict[str, Any]:
    numbers, runs = totals.numbers, totals.runs
    reached = int(numbers[goal])
    return {
        "values": values,
        "runs": runs,
        "goal": goal,
        goal: reached,
        "walked": int(numbers["walked"]),
        "falls": int(numbers["falls"]),
        "doubtful": int(numbers["doubtful"]),
        "rate": reached / runs,
        "interval": list(wilson(reached, runs)),
        **{name: numbers[name] for name in HEAD},
    }


def goal_at(point: Mapping[str, Any]) -> tuple[str, int]:
    """The goal of the runs at a point, and how many of them reached it; older results count those that walked."""
    goal = point.get("goal", "walked")
    return goal, point[goal]


def thresholds(scenario: Scenario, points: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The robust threshold of the first swept key, if that is a number: how far every smaller value holds too.

    A value holds when at least `threshold.rate` of the runs reach their goal *at every point* that has it. Values are
    taken by size, from zero outwards and separately for either sign, so that one lucky pocket beyond a failure counts
    nothing.
    It is sure to hold, or to fail, when the whole of Wilson's 95 % interval says so, at every point or at one.

    Returns:
        For either sign that occurs: `key`, `sign` (+1 or -1), `rate`, `holds_to` (None if not even the smallest holds),
        `sure_to` (likewise), `fails_at` (None if all hold), `surely_fails` (whether it is sure to fail there) and
        `runs`, the fewest at a point.
    """
    key, values = next(iter(scenario.sweep.items()))
    numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
    if len(numbers) < len(values) or len(points) < len(points_of(scenario)):
        return []  # words have no size, and points without runs no rate
    out, rate = [], scenario.threshold.rate
    at: dict[Any, list[Mapping[str, Any]]] = {value: [] for value in numbers}
    for point in points:
        at[point["values"][key]].append(point)
    for sign in (1, -1):
        ladder = sorted({value for value in numbers if sign * value > 0 or (value == 0 and sign > 0)}, key=abs)
        if not ladder:
            continue
        holds_to, sure_to, fails_at, surely_fails = None, None, None, False
        sure = True
        for value in ladder:
            here = at[value]
            if not here or min(point["rate"] for point in here) < rate:
                fails_at = value
                surely_fails = any(point["interval"][1] < rate for point in here)
                break
            holds_to = value
            sure = sure and min(point["interval"][0] for point in here) >= rate
            sure_to = value if sure else sure_to
        out.append(
            {
                "key": key, "sign": sign, "rate": rate, "holds_to": holds_to, "sure_to": sure_to, "fails_at": fails_at,
                "surely_fails": surely_fails, "runs": min((point["runs"] for point in points), default=0),
            }
        )  # fmt: skip
    return out


def threshold_words(t: Mapping[str, Any]) -> str:
    """A threshold in words, and what its runs are too few to say."""
    way = "upwards" if t["sign"] > 0 else "downwards"
    holds = "not even the smallest value holds" if t["holds_to"] is None else f"holds to {t['holds_to']:g}"
    fails = "" if t["fails_at"] is None else f", fails at {t['fails_at']:g}"
    at = f"at a rate of {t['rate']:.0%} at every point"
    return f"threshold of {t['key']} from zero {way}, {at}: {holds}{fails}{_doubt(t)}"


def _doubt(t: Mapping[str, Any]) -> str:
    """Words on how much of a threshold is chance; empty if its intervals say all of it."""
    if t["holds_to"] == t["sure_to"] and (t["fails_at"] is None or t["surely_fails"]):
        return ""
    best, enough = wilson(t["runs"], t["runs"])[0], enough_for(t["rate"])
    if best < t["rate"]:
        takes = "no number of runs shows that" if enough is None else f"{t['rate']:.0%} takes {enough}"
        return f"; too few runs to say: {t['runs']} at a point show {best:.0%} at most, {takes}"
    sure = "nowhere" if t["sure_to"] is None else f"to {t['sure_to']:g}"
    failing = "" if t["fails_at"] is None or t["surely_fails"] else ", and the failure may be chance"
    return f"; the 95 % intervals are sure of it {sure}{failing}"
