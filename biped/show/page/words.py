"""Numbers and intervals as this page writes them."""

from __future__ import annotations

import math
from typing import Any

from biped.ensemble.checks import FAILED, NOTHING, PASSED, UNDECIDED
from biped.scenario.metrics import Metric
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


UNITS = {"slope": "°", "friction": "", "at": "s", "duration": "s", "speed": "m/s", "jitter": "rad", "lag": "s",
         "control_rate": "Hz", "timestep": "s", "torque_limit": "N m"}  # fmt: skip
"""Units of scenario keys by the last word of the key."""
_WAYS = {"0": "forward", "1": "up, in space to the left", "2": "up"}
"""Which way the components of a push go."""


def _named(key: str) -> tuple[str, str]:
    """A scenario key in words, and its unit: `push.0.force.0` is a push forward in N.

    (The second component is one up in the plane, and one to the left in space.)
    """
    parts = key.split(".")
    if parts[0] == "push" and len(parts) == 4 and parts[2] == "force":
        return f"push {_WAYS.get(parts[3], parts[3])}", "N"
    if key.startswith("start: "):
        return key, "°"
    words = " ".join(part for part in parts if not part.isdigit())
    return words.replace("_", " "), UNITS.get(parts[-1], "")


def key_words(key: str) -> str:
    """A scenario key for people, with its unit in brackets where it has one."""
    words, unit = _named(key)
    return f"{words} [{unit}]" if unit else words


def setting(key: str, value: Any) -> str:
    """A scenario key and its value for people."""
    words, unit = _named(key)
    return f"{words} {value_of(value)} {unit}".rstrip()


def metric_text(metric: Metric, value: Any) -> str:
    """A metric's value, large numbers written out."""
    if value is not None and metric.show == "number" and math.isfinite(value) and abs(value) >= 1000.0:
        return f"{float(f'{value:.3g}'):.0f}".replace("-", "−")
    return metric.text(value).replace("-", "−")
