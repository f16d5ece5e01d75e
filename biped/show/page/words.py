"""Numbers and intervals as this page writes them."""

from __future__ import annotations

import math
from typing import Any

from biped.ensemble.checks import FAILED, NOTHING, PASSED, UNDECIDED
from biped.scenario.metrics import Metric
from biped.scenario.reference import unit_of
from biped.show.page.html import Markup, tag


def percent(share: float) -> str:
    """A share as a percentage, with a digit behind the point where whole ones would say 0 or 100 of neither."""
    whole = 100.0 * share
    if (0.0 < whole < 1.0) or (99.0 < whole < 100.0):
        return f"{whole:.1f} %"
    return f"{whole:.0f} %"


def between(low: float, high: float) -> str:
    """An interval of shares."""
    return f"{percent(low).removesuffix(' %')} – {percent(high)}"


def value_of(value: Any) -> str:
    """A swept or drawn value."""
    if isinstance(value, list | tuple):
        return f"({', '.join(value_of(one) for one in value)})"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:.4g}".replace("-", "−") if math.isfinite(value) else "–"
    return "–" if value is None else str(value)


def chip(passed: bool, good: str = "✓ passed", bad: str = "✗ failed") -> Markup:
    """A verdict in a word, told by more than its colour."""
    return tag("span", good if passed else bad, class_=f"chip {'good' if passed else 'bad'}")


_CHIPS = {PASSED: ("✓ passed", "good"), FAILED: ("✗ failed", "bad"), UNDECIDED: ("? undecided", "quiet"),
          NOTHING: (NOTHING, "quiet")}  # fmt: skip


def judged(judgement: str) -> Markup:
    """A judgement on a result or a check (`biped.ensemble.checks`) as a chip."""
    words, kind = _CHIPS[judgement]
    return tag("span", words, class_=f"chip {kind}")


_WAYS = {True: ("forward", "to the left", "up"), False: ("forward", "up")}
"""Which way the components of a force go, in space and in the plane."""
_FORCES = ("push", "disturbance")


def _named(key: str, space: bool) -> tuple[str, str]:
    """A scenario key in words, and its unit: `push.0.force.0` is a push forward in N."""
    parts = key.split(".")
    if key.startswith("start: "):
        return key, "°"
    way = ""
    if parts[0] in _FORCES and parts[-2] == "force" and parts[-1].isdigit():
        ways, which = _WAYS[space], int(parts.pop())
        way = f" {ways[which]}" if which < len(ways) else ""
        parts.pop()
    words = [f"{int(part) + 1}" if part.isdigit() else part for part in parts if part != "0"]
    return " ".join(words).replace("_", " ") + way, unit_of(key)


def key_words(key: str, space: bool = False) -> str:
    """A scenario key for people, with its unit in brackets where it has one.

    Args:
        key: Dotted.
        space: Whether the robot moves in space, where a force's second component goes to the left.
    """
    words, unit = _named(key, space)
    return f"{words} [{unit}]" if unit else words


def setting(key: str, value: Any, space: bool = False) -> str:
    """A scenario key and its value for people."""
    words, unit = _named(key, space)
    return f"{words} {value_of(value)} {unit}".rstrip()


def metric_text(metric: Metric, value: Any) -> str:
    """A metric's value, large numbers written out."""
    if value is not None and metric.show == "number" and math.isfinite(value) and abs(value) >= 1000.0:
        return f"{float(f'{value:.3g}'):.0f}".replace("-", "−")
    return metric.text(value).replace("-", "−")
