"""Definitions of walking, standing and sitting: of a run that stayed up and whose sentinels hold, from its numbers.

A walker goes forward, by steps of one leg after the other, on ground that bears its weight. The bounds stand clear of
what walks here show (all shipped scenarios and the four gaits at home): support 0.97 … 1.02, in the air for at most
8 % of the window, which is chatter of contacts, and at least a third of the foot strikes the other leg's.
"""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.measure.verdict import DIVERGENT, DOUBTFUL, SOUND
from biped.robot.planar.description import Walked

ALTERNATION = 0.2
"""Least share of its foot strikes in the window that are the other leg's than the one before."""
SUPPORT = (0.8, 1.2)
"""Mean ground force / weight under it in the window."""
FLIGHT = 0.2
"""Share of the window that it may be in the air: walking has no flight, running has more."""
SLIP = 0.3
"""Most that loaded feet slide on the way / that way: of a biped that slides along on one foot 1, on both 2."""
PULL = 0.15
"""Most that declared pushes pull a walker along, as a mean over the window / weight: a slope of 8.6 degrees does."""
SUNK = 0.05
"""Most that a foot is below the ground that it is said to stand on / leg length."""
LEANING = 60.0
"""[degrees] Most that the trunk of one that walks, stands or sits leans: on its back it would be 90."""
LOW = 0.4
"""Least height of the centre of mass of one that walks, stands or sits / leg length: whose knees and hips are in the
ground, which bears its feet alone, is at 0.2."""
STRAIGHT = 5.0
"""[degrees] Most that a straight walk's way, and its heading in the end, differ from the x axis."""
STILL = 0.1
"""[m] that a standing or sitting biped's torso may sway either way."""
SETTLED = 1.0
"""[s] of the shortest window in which a biped can be seen to stand or sit still."""
STRAYING, STRAYED, TURNING = 0.15, 0.3, 0.3
"""Most that what was commanded may differ from what was done: [m/s], as a share of it, and [rad/s]."""
SEATED, UNSEATED = 0.5, 0.01
"""Least share of its weight that a sitter gives to the seat, and most that somebody who stands leaves there."""


def walked(numbers: Mapping[str, Any], seconds: float, least: Walked) -> bool:
    """Whether a run that stayed up walked; one that lacks a number did not.

    Args:
        numbers: Its metrics.
        seconds: [s] that it took.
        least: How fast a robot of its kind must be.
    """
    if followed(numbers) is not None:
        return bool(followed(numbers)) and _no_steps(numbers) is None
    forward = numbers["distance"] > least.distance * seconds and numbers["speed"] > least.speed
    return forward and _no_steps(numbers) is None


def followed(numbers: Mapping[str, Any]) -> bool | None:
    """Whether a run did what it was commanded; None where it was commanded nothing."""
    error, yaw = _real(numbers.get("command_error")), _real(numbers.get("yaw_error"))
    if math.isnan(error):
        return None
    return error < max(STRAYING, STRAYED * _real(numbers["commanded"])) and yaw < TURNING


def _straight(numbers: Mapping[str, Any]) -> bool:
    """Whether a walk in space went along x, and still heads there."""
    return abs(numbers["heading"]) <= STRAIGHT and abs(numbers["veering"]) <= STRAIGHT


def stood(numbers: Mapping[str, Any], seconds: float) -> bool:
    """Whether a run that stayed up stood still in the window: without a step, its torso no further than `STILL`.

    Args:
        numbers: Its metrics.
        seconds: [s] of the window.
    """
    still = numbers["steps"] == 0 and numbers["strayed"] < STILL and seconds >= SETTLED
    return _borne(numbers) is None and still and not _real(numbers["seat_load"]) > UNSEATED


def sat(numbers: Mapping[str, Any], seconds: float) -> bool:
    """Whether a run that stayed up sat still in the window: most of its weight on the seat, the rest on its feet.

    Args:
        numbers: Its metrics.
        seconds: [s] of the window.
    """
    seated = _real(numbers["seat_load"])
    borne = SUPPORT[0] <= seated + _real(numbers["foot_support"]) <= SUPPORT[1]
    still = numbers["strayed"] < STILL and seconds >= SETTLED
    return seated >= SEATED and borne and still and _leaning(numbers) is None


TOLD_BY = ("end", "cause", "verdict", "doubt", "walked", "stood", "sat", "flight", "support", "alternation",
           "foot_support", "sinking", "com_height", "tilt", "slip",
           "pull")  # fmt: skip
"""Columns of a row that `outcome` reads."""
_ENDED = re.compile("fell|collapsed")
"""How the cause of a fall begins."""
_SENTINEL = re.compile("(energy|momentum) not accounted for|energy from nowhere|contacts chattering")
"""How a sentinel's words begin."""


def outcome(run: Mapping[str, Any]) -> str:
    """The outcome of a run in words, and beside it the verdict on its numbers unless they are sound.

    Args:
        run: Its row, from memory or from a file (where a number that does not exist is None).
    """
    run = apart(run)
    return "; ".join(filter(None, (_outcome(run), _doubt(run))))


def kind_of(run: Mapping[str, Any]) -> str:
    """The outcome and the verdict of a run without times and numbers, so that runs can be counted by them."""
    run = apart(run)
    return "; ".join(re.split(_WHEN, words)[0] for words in (_outcome(run), _doubt(run)) if words)


def apart(run: Mapping[str, Any]) -> Mapping[str, Any]:
    """A row whose verdict stands beside its end; rows from before had `doubtful` or `diverged` for an end."""
    if isinstance(run.get("verdict"), str):
        return run
    end, cause = run["end"], run.get("cause") or ""
    if end not in ("doubtful", "diverged"):
        return {**run, "verdict": SOUND, "doubt": ""}
    parts = cause.split("; ")
    own = "" if _SENTINEL.match(parts[-1]) else parts.pop()
    if end == "diverged" and not _SENTINEL.match(cause):
        return {**run, "verdict": DIVERGENT, "doubt": ""}
    fell = _ENDED.match(own) is not None
    became = "fell" if fell else "raised" if own else "completed"
    more = {"fell": True} if fell and "fell" in run else {}
    return {**run, **more, "end": became, "cause": own, "verdict": end, "doubt": "; ".join(parts)}


_WHEN = r" (?:at|after|before) (?=\d)"


def _outcome(run: Mapping[str, Any]) -> str:
    """The outcome in words."""
    if run["end"] == "diverged":
        return f"diverged: {run['cause']}"
    if run["end"] != "completed":
        return run["cause"]
    if run["verdict"] != SOUND:
        return "stayed up"  # whether it walked, numbers that cannot be believed do not say
    if run["walked"]:
        return "walked"
    if run["stood"]:
        return "stood still"
    if run.get("sat") == 1:  # results from before there were seats have none, or nan
        return "sat still"
    slow = "too slow" if followed(run) is None else "not as commanded"
    return f"stayed up without walking: {_no_steps(run) or slow}"


def _doubt(run: Mapping[str, Any]) -> str:
    """The verdict in words; nothing where the numbers are sound, or where the end says it."""
    return "" if run["verdict"] == SOUND or not run["doubt"] else f"{run['verdict']}: {run['doubt']}"


def airborne(run: Mapping[str, Any]) -> bool:
    """Whether a run was in the air for more of the window than a walker is."""
    return _real(run["flight"]) >= FLIGHT


def _borne(numbers: Mapping[str, Any]) -> str | None:
    """The reason why the ground does not bear the biped by its feet, upright; None if it does.

    Numbers that rows of versions before do not have (`foot_support` and those that follow) say nothing.
    """
    flight, support = _real(numbers["flight"]), _real(numbers["support"])
    if not flight < FLIGHT:
        return "in the air"
    if not SUPPORT[0] <= support <= SUPPORT[1]:
        return "not borne by the ground"
    if _real(numbers.get("foot_support")) < SUPPORT[0]:
        return "not borne by its feet"
    if _real(numbers.get("sinking")) > SUNK:
        return "its feet sink into the ground"
    return _leaning(numbers)


def _leaning(numbers: Mapping[str, Any]) -> str | None:
    """The reason why a biped is not upright; None if it is."""
    if _real(numbers.get("com_height")) < LOW:
        return "on the ground"
    return "not upright" if _real(numbers.get("tilt")) > LEANING else None


def _no_steps(numbers: Mapping[str, Any]) -> str | None:
    """The reason why a run did not step along the ground; None if it did."""
    air = _borne(numbers)
    if air is not None:
        return air
    if not _real(numbers["alternation"]) >= ALTERNATION:
        return "no steps of one leg after the other"
    if _real(numbers.get("pull")) > PULL:
        return "pulled along"
    return "its feet slide" if _real(numbers.get("slip")) > SLIP else None


def _real(value: float | None) -> float:
    return math.nan if value is None else value


def outcome_of(t: Trajectory, numbers: dict[str, Any], verdict: str, seconds: float) -> dict[str, int]:
    """The outcome of a run and the verdict on its numbers, each 0 or 1.

    A fall is a fall whatever the verdict; only a run with sound numbers can have walked, stood or sat.

    Args:
        t: The run.
        numbers: Its metrics.
        verdict: On its numbers (`biped.measure.verdict`).
        seconds: Length of the window.
    """
    up = t.end == "completed" and verdict == SOUND
    on_foot = up and walked(numbers, len(t) * t.tick, t.robot.walked)
    return {
        "falls": int(t.end == "fell" or verdict == DIVERGENT),
        "diverged": int(verdict == DIVERGENT),
        "doubtful": int(verdict == DOUBTFUL),
        "walked": int(on_foot),
        "straight": int(on_foot and (t.robot.planar or _straight(numbers))),
        "stood": int(up and stood(numbers, seconds)),
        "sat": int(up and sat(numbers, seconds)),
    }


def stopped(t: Trajectory, outcome: dict[str, int]) -> dict[str, float]:
    """How far [m] a run that stood at last went from its first change on; nothing of others."""
    if not (t.changes and outcome["stood"]):
        return {}
    told = min(int(np.searchsorted(t.time, t.changes[0] - 1e-9)), len(t) - 1)
    return {"stopping_distance": float(t.x[-1] - t.x[told])}


def spread(values: np.ndarray) -> dict[str, float]:
    """Mean, smallest and largest of the numbers among values (n,); nan if there are none."""
    real = values[np.isfinite(values)]
    if not len(real):
        return dict.fromkeys(("mean", "min", "max"), math.nan)
    return {"mean": float(real.mean()), "min": float(real.min()), "max": float(real.max())}
