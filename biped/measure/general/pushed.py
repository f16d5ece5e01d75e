"""What a push is worth in space, and how a walk comes back from it."""

from __future__ import annotations

import math

import numpy as np

from biped.measure.general.gait import heel_places
from biped.measure.general.trajectory import GeneralTrajectory
from biped.measure.metrics.pushed import STEP_NAMES, STEPS, Impact, merged, recovery
from biped.robot.gravity import GRAVITY


def impulses(t: GeneralTrajectory) -> list[Impact]:
    """The pushes of a run; those that touch or overlap in time are one."""
    return merged([(start, end, force) for start, end, *force, _ in t.pushes], len(t) * t.tick, t.tick)


def size(impulse: np.ndarray) -> float:
    """[N s] of an impulse (3,) with the sign of its way: of the first of forward, left and up that it has."""
    return math.copysign(float(np.linalg.norm(impulse)), next((one for one in impulse if one), 0.0))


def pushed(t: GeneralTrajectory) -> dict[str, float]:
    """Impulse of the strongest push, the recovery from the last one, and the steps after that.

    See `biped.measure.metrics.pushed.pushed`.
    """
    found = impulses(t)
    if not found:
        return {}
    strongest = max((size(np.array(push.impulse)) for push in found), key=abs)
    rows = np.array([row for row, _ in t.strikes], dtype=int)
    heel = heel_places(t)[rows]
    lengths = np.abs(heel[:, 0] - heel[:, 1])
    after = lengths[t.time[rows] >= found[-1].end - 1e-9][:STEPS]
    mass = t.robot.mass
    back = math.nan
    if t.end == "completed":
        back = recovery(t.base[:, 0], t.time, t.tick, rows, found[0].start, found[-1].end)
    return {
        "push_impulse": strongest,
        "push_speed": strongest / mass,
        "push_froude": strongest / (mass * math.sqrt(GRAVITY * t.robot.leg)),
        "recovery_time": back,
        **dict(zip(STEP_NAMES, (float(length) for length in after), strict=False)),
    }
