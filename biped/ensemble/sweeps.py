"""What a sweep says: success at every point with its interval, and thresholds below which everything holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from biped.base.statistics import wilson
from biped.measure.metrics import aggregate
from biped.scenario.keys import Scenario
from biped.scenario.vary import points_of


def by_point(scenario: Scenario, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One record per point of the sweep.

    Args:
        scenario: The campaign's scenario.
        rows: Rows of its runs, in any order; points without rows are left out.

    Returns:
        `values` (key to value), `runs`, `walked`, `falls`, `rate`, `interval` (Wilson, 95 %), `speed`,
        `cost_of_transport` and `double_support` (means over the runs that walked).
    """
    out = []
    runs = scenario.randomise.runs
    for number, values in enumerate(points_of(scenario)):
        mine = [dict(row) | {"falls": row["fell"]} for row in rows if row["index"] // runs == number]
        if not mine:
            continue
        summary = aggregate(mine)
        walked = int(summary["walked"])
        out.append(
            {
                "values": values,
                "runs": len(mine),
                "walked": walked,
                "falls": int(summary["falls"]),
                "rate": walked / len(mine),
                "interval": list(wilson(walked, len(mine))),
                **{name: summary[name] for name in ("speed", "cost_of_transport", "double_support")},
            }
        )
    return out


def thresholds(scenario: Scenario, points: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The robust threshold of the first swept key, if that is a number: how far every smaller value holds too.

    A value holds when at least `threshold.rate` of the runs walked *at every point* that has it. Values are taken by
    size, from zero outwards and separately for either sign, so that one lucky pocket beyond a failure counts nothing.

    Returns:
        For either sign that occurs: `key`, `sign` (+1 or -1), `rate`, `holds_to` (None if not even the smallest holds)
        and `fails_at` (None if all hold).
    """
    key, values = next(iter(scenario.sweep.items()))
    numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
    if len(numbers) < len(values):
        return []
    out = []
    for sign in (1, -1):
        ladder = sorted({value for value in numbers if sign * value > 0 or (value == 0 and sign > 0)}, key=abs)
        if not ladder:
            continue
        holds_to, fails_at = None, None
        for value in ladder:
            rates = [point["rate"] for point in points if point["values"][key] == value]
            if not rates or min(rates) < scenario.threshold.rate:
                fails_at = value
                break
            holds_to = value
        out.append(
            {"key": key, "sign": sign, "rate": scenario.threshold.rate, "holds_to": holds_to, "fails_at": fails_at}
        )
    return out


def threshold_words(t: Mapping[str, Any]) -> str:
    """A threshold in words."""
    way = "upwards" if t["sign"] > 0 else "downwards"
    holds = "not even the smallest value holds" if t["holds_to"] is None else f"holds to {t['holds_to']:g}"
    fails = "" if t["fails_at"] is None else f", fails at {t['fails_at']:g}"
    return f"threshold of {t['key']} from zero {way}, at a rate of {t['rate']:.0%} at every point: {holds}{fails}"
