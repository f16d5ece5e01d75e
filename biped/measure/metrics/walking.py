"""What walking and standing are: of a run that stayed up and whose sentinels hold, from its numbers.

A walker goes forward, by steps of one leg after the other, on ground that bears its weight. The bounds stand clear of
what walks here show (all shipped scenarios and the four gaits at home): support 0.97 … 1.02, in the air for at most
8 % of the window, which is chatter of contacts, and at least a third of the foot strikes the other leg's.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

MEAN = 0.2
"""[m/s] above which a walker is on average of the whole run."""
SPEED = 0.3
"""[m/s] above which it is in the window."""
ALTERNATION = 0.2
"""Least share of its foot strikes in the window that are the other leg's than the one before."""
SUPPORT = (0.8, 1.2)
"""Mean ground force / weight under it in the window."""
FLIGHT = 0.2
"""Share of the window that it may be in the air: walking has no flight, running has more."""
STILL = 0.1
"""[m] that a standing biped's torso may sway either way."""


def walked(numbers: Mapping[str, Any], seconds: float) -> bool:
    """Whether a run of `seconds` [s] that stayed up walked; one that lacks a number did not."""
    return _short_of(numbers, seconds) is None


def stood(numbers: Mapping[str, Any]) -> bool:
    """Whether a run that stayed up stood still in the window: without a step, its torso no further than `STILL`."""
    return _borne(numbers) is None and numbers["steps"] == 0 and numbers["strayed"] < STILL


def outcome(run: Mapping[str, Any]) -> str:
    """What became of a run, in words.

    Args:
        run: Its row, from memory or from a file (where a number that does not exist is None).
    """
    if run["end"] in ("diverged", "doubtful"):
        return f"{run['end']}: {run['cause']}"
    if run["end"] != "completed":
        return run["cause"]
    if run["walked"]:
        return "walked"
    if run["stood"]:
        return "stood still"
    return f"stayed up without walking: {_short_of(run, run['time'])}"


def kind_of(run: Mapping[str, Any]) -> str:
    """What became of a run without its time and numbers, so that runs can be counted by it."""
    return re.split(r" (?:at|after|before) (?=\d)", outcome(run))[0]


def airborne(run: Mapping[str, Any]) -> bool:
    """Whether a run was in the air for more of the window than a walker is."""
    return _real(run["flight"]) >= FLIGHT


def _borne(numbers: Mapping[str, Any]) -> str | None:
    """What says that the ground does not bear the biped's weight; None if it does."""
    flight, support = _real(numbers["flight"]), _real(numbers["support"])
    if not flight < FLIGHT:
        return "in the air"
    if not SUPPORT[0] <= support <= SUPPORT[1]:
        return "not borne by the ground"
    return None


def _short_of(numbers: Mapping[str, Any], seconds: float) -> str | None:
    """What a run lacks of a walk; None if it is one."""
    air = _borne(numbers)
    if air is not None:
        return air
    if not (_real(numbers["distance"]) > MEAN * seconds and _real(numbers["speed"]) > SPEED):
        return "too slow"
    if not _real(numbers["alternation"]) >= ALTERNATION:
        return "no steps of one leg after the other"
    return None


def _real(value: float | None) -> float:
    return math.nan if value is None else value
