"""What a sweep says: success at every point with its interval, and thresholds below which everything holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from biped.base.statistics import enough_for, wilson
from biped.measure.metrics import aggregate
from biped.scenario.keys import Scenario
from biped.scenario.metrics import HEAD
from biped.scenario.vary import points_of


def by_point(scenario: Scenario, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One record per point of the sweep.

    Args:
        scenario: The campaign's scenario.
        rows: Rows of its runs, in any order; points without rows are left out.

    Returns:
        `values` (key to value), `runs`, `walked`, `falls`, `doubtful`, `rate`, `interval` (Wilson, 95 %), and the
        metrics of `HEAD` (means over the runs that walked).
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
                "doubtful": int(summary["doubtful"]),
                "rate": walked / len(mine),
                "interval": list(wilson(walked, len(mine))),
                **{name: summary[name] for name in HEAD},
            }
        )
    return out


def thresholds(scenario: Scenario, points: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The robust threshold of the first swept key, if that is a number: how far every smaller value holds too.

    A value holds when at least `threshold.rate` of the runs walked *at every point* that has it. Values are taken by
    size, from zero outwards and separately for either sign, so that one lucky pocket beyond a failure counts nothing.
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
    for sign in (1, -1):
        ladder = sorted({value for value in numbers if sign * value > 0 or (value == 0 and sign > 0)}, key=abs)
        if not ladder:
            continue
        holds_to, sure_to, fails_at, surely_fails = None, None, None, False
        sure = True
        for value in ladder:
            here = [point for point in points if point["values"][key] == value]
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
    """What is left to chance in a threshold; nothing if its intervals say all of it."""
    if t["holds_to"] == t["sure_to"] and (t["fails_at"] is None or t["surely_fails"]):
        return ""
    best, enough = wilson(t["runs"], t["runs"])[0], enough_for(t["rate"])
    if best < t["rate"]:
        takes = "no number of runs shows that" if enough is None else f"{t['rate']:.0%} takes {enough}"
        return f"; too few runs to say: {t['runs']} at a point show {best:.0%} at most, {takes}"
    sure = "nowhere" if t["sure_to"] is None else f"to {t['sure_to']:g}"
    failing = "" if t["fails_at"] is None or t["surely_fails"] else ", and the failure may be chance"
    return f"; the 95 % intervals are sure of it {sure}{failing}"
