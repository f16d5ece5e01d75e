"""Contact forces, centre of pressure, slip, penetration and foot clearance."""

import math

import numpy as np

from biped.measure.contact import swings_of
from biped.measure.metrics.gait import travelled
from biped.measure.metrics.sums import grounded
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory

_SWING = 0.1
"""[s] in the air from which a swing has a clearance."""


def contact(t: Trajectory, span: slice) -> dict[str, float]:
    """Support, pull, sinking, centre of pressure, slip, losses and clearance over a span of rows."""
    weight, sums = -t.mass * t.gravity[2], grounded(t, span)
    return {
        "support": float(t.ground_force[span, 2].mean() / weight),
        "foot_support": float(t.foot_force[span].sum(axis=1).mean() / weight),
        "sinking": max(0.0, -float(t.above[span].min())) / t.robot.leg,
        "com_height": float(t.com_above[span].min()) / t.robot.leg,
        **({"pull": pull(t, span) / weight} if t.pushes else {}),
        **({} if t.seat_force is None else {"seat_load": float(t.seat_force[span, 1].mean() / weight)}),
        "centre_of_pressure": sums.pressure,
        "slip": sums.slid / travelled(t, span),
        "contact_loss": sums.lost / (t.tick * (span.stop - span.start - 1)),
        "clearance": clearance(t, span),
    }


def pull(t: Trajectory, span: slice) -> float:
    """Mean force [N] of the declared pushes along the way over a span of rows, backward negative."""
    begin, end = float(t.time[span.start]), float(t.time[span.start]) + t.tick * (span.stop - span.start)
    way = np.array([float(one[span.stop - 1] - one[span.start]) for one in (t.x, t.y)])
    impulse = np.zeros(2)
    for push in declared(t):
        impulse += max(0.0, min(push.end, end) - max(push.start, begin)) * np.array(push.force[:2])
    return float(impulse @ way) / ((end - begin) * (math.hypot(*way) or math.inf))


def clearance(t: Trajectory, span: slice) -> float:
    """Lowest point of a foot above the ground in the middle half of its swings [m]: the smallest of a span's.

    Swings that the span cuts are left out.
    """
    lowest, least, feet = math.nan, round(_SWING / t.tick), t.robot.of_foot
    down, above = t.down[span], t.above[span]
    for foot in range(len(t.robot.feet)):
        for swing in swings_of(down, foot):
            length = swing.stop - swing.start
            if length >= least:
                middle = slice(swing.start + length // 4, swing.stop - length // 4)
                lowest = float(np.fmin(lowest, above[middle][:, feet == foot].min()))
    return lowest
