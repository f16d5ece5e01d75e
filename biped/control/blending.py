"""Gains, torques and falling feet that change in time instead of at once: [[change]], smoothing, and soft landings.

Of a first-order lag of the actuators the law knows nothing; of its own smoothing it does, and every torque it asks for
is one that it means.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace

from biped.base.jit import inner_kernel, kernel
from biped.robot.leg_states import FIRST_IN_AIR
from biped.robot.planar.topology import LEGS
from biped.scenario.gains import LACKED, Gains
from biped.scenario.gait import whole_pace
from biped.scenario.keys import Scenario
from biped.scenario.transitions import TRANSITIONS


class Changes(NamedTuple):
    """A run's changes.

    Attributes:
        gait: (m,) the numbers of the controller record's gait, live.
        steps: (n,) of a type that `step_type` made, in time order.
        phase: (2,) index of the legs' states, as of the latest tick, live.
    """

    gait: np.ndarray
    steps: np.ndarray
    phase: np.ndarray


def step_type(gait: np.dtype, *settings: tuple[str, str]) -> np.dtype:
    """Of one change: ticks (its first, and until its gains hold), the gaits that it begins and ends at.

    One that waits for a foot knows how many ticks after its landing it begins (-1: it does not wait), which legs were
    in the air a tick ago, and for how many ticks one has been on the ground (-1: none has landed).

    Args:
        gait: Of the controller record, of doubles alone.
        settings: Name and type of what changes with its first tick besides.
    """
    size = gait.itemsize // np.dtype(float).itemsize
    return np.dtype(
        [("first", "i8"), ("count", "i8"), ("begun", "u1"), ("complete", "u1"), ("waits", "i8"), ("air", "u1", LEGS),
         ("landed", "i8"), ("before", "f8", size), ("after", "f8", size),
         *settings], align=True,
    )  # fmt: skip


def changes_in(
    record: np.ndarray, step: np.dtype, s: Scenario, gains: Gains, set_gains: Callable[[np.void, Gains], None]
) -> Changes:
    """A run's changes; gains that a change does not name stay as they are.

    Args:
        record: (1,) the controller's, whose part "gait" is changed; its part "memory" has the legs' states.
        step: Of a change (`step_type`).
        s: The scenario.
        gains: What the run starts with.
        set_gains: Writes a gait into such a part.
    """
    kind, first = record.dtype["gait"], record.dtype.fields["gait"][1]  # type: ignore[index]
    begun = gains
    steps, one = np.zeros(len(s.change), step), np.zeros(1, kind)
    rate = s.simulation.control_rate
    for i, (c, change) in enumerate(zip(steps, s.change, strict=True)):
        c["first"], c["count"] = round(change.at * rate), max(1, round((change.over or 0.0) * rate))
        c["waits"] = -1 if change.after_landing is None else round(change.after_landing * rate)
        c["landed"] = -1
        set_gains(one[0], gains)
        c["before"] = one.view(float)
        if change.controller is not None or change.to in TRANSITIONS:  # a gait does not say what it lacks
            gains = replace(gains, **dict.fromkeys(LACKED))
        gains = (begun if change.to == "first" else gains).replaced(change.gains)
        whole_pace(gains, f"change[{i}].")
        set_gains(one[0], gains)
        c["after"] = one.view(float)
    return Changes(np.ndarray(one.view(float).shape, float, record, first), steps, record["memory"]["phase"][0])


@kernel
def blend(changes, k):
    """Brings the gait of `Changes` to tick k."""
    gait, steps = changes.gait, changes.steps
    for i in range(steps.size):
        step = steps[i]
        if step["complete"]:
            continue
        if k < step["first"]:
            return
        if step["waits"] >= 0:
            _look_for_landing(step, changes.phase)
            if step["landed"] < step["waits"]:
                return
            step["waits"] = -1
        if not step["begun"]:  # as late as the one before it has ended, or its foot has landed
            step["begun"], step["first"] = True, k
        share = min(1.0, (k - step["first"] + 1) / step["count"])
        rest = 1.0 - share
        for j in range(gait.size):
            gait[j] = rest * step["before"][j] + share * step["after"][j]
        step["complete"] = k - step["first"] + 1 >= step["count"]
        if not step["complete"]:
            return


@inner_kernel
def _look_for_landing(step, phase):
    """Counts the ticks since a foot has come down, the first one that does."""
    if step["landed"] >= 0:
        step["landed"] += 1
    for leg in range(LEGS):
        in_air = phase[leg] >= FIRST_IN_AIR
        if step["air"][leg] and not in_air and step["landed"] < 0:
            step["landed"] = 0
        step["air"][leg] = in_air


def fraction(time_constant: float, tick: float) -> float:
    """The fraction of its way that a first-order lag goes in a tick.

    Args:
        time_constant: [s]; 0: at once.
        tick: [s].

    Returns:
        1 - exp(-tick / time_constant).
    """
    return 1.0 - math.exp(-tick / time_constant) if time_constant > 0.0 else 1.0


def most_in_a_tick(slew: float, tick: float) -> float:
    """The largest change of a torque in a tick [N m].

    Args:
        slew: Largest rate [N m/s]; 0: any.
        tick: [s].
    """
    return slew * tick if slew > 0.0 else math.inf


@kernel
def smooth(u, latest, follow, most, first):
    """Takes torques a fraction of the way from the latest ones to those asked for, no further than they can, in place.

    Both are within the torque limits, so what lies between is.

    Args:
        u: (n,) torques asked for [N m].
        latest: (n,) of the tick before; remembers the new ones.
        follow: The fraction, from `fraction`.
        most: Largest change [N m], from `most_in_a_tick`.
        first: Whether this is the run's first tick, in which torques are those asked for.
    """
    for j in range(u.size):
        change = 0.0 if first else follow * (u[j] - latest[j])
        if abs(change) > most:
            u[j] = latest[j] + math.copysign(most, change)
        elif follow < 1.0 and not first:
            u[j] = latest[j] + change
        latest[j] = u[j]


@inner_kernel
def downward(speed, height, approach, braking):
    """Largest acceleration [m/s²] towards the ground that the wanted motion may have at a point.

    A critically damped spring would let a point down with 2 v/τ + height/τ². Where that is negative the point comes
    down too fast to land without an impact, and the motion takes a share of it as the deceleration that it wants.

    Args:
        speed: [m/s] v with which the point rises.
        height: [m] of the point.
        approach: [s] τ.
        braking: The share; 0: a point that comes down fast keeps its speed.
    """
    most = 2.0 * speed / approach + height / (approach * approach)
    if most >= 0.0:
        return most
    return braking * min(0.0, most - min(0.0, height) / (approach * approach))
