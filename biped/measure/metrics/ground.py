"""Contact forces, centre of pressure, slip, penetration and foot clearance."""

import math
from typing import NamedTuple

import numpy as np

from biped.base.jit import entry_kernel
from biped.measure.contact import LOADED, along_feet, swings_of
from biped.measure.metrics.gait import travelled
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY

_SWING = 0.1
"""[s] in the air from which a swing has a clearance."""


class Grounded(NamedTuple):
    """Sums over the contact of ground and feet in a span.

    Attributes:
        lost: [J] work that contacts took: the force of each row times how far its point goes until the next.
        slid: [m] way of loaded feet from row to row, of each foot the mean over its points weighted by their forces.
        pressure: Mean place of the normal force along a loaded foot, 0 heel … 1 toe; nan if none ever is.
    """

    lost: float
    slid: float
    pressure: float


def grounded(t: Trajectory, span: slice) -> Grounded:
    """Sums what ground and feet did to each other in a span of rows; tests/measure/referee.py has it in NumPy."""
    least = LOADED * t.mass * GRAVITY
    lost, slid, pressure, count = _grounded(
        t.force[span], t.point[span], t.robot.of_foot, along_feet(t.robot), least, np.zeros((3, len(t.robot.feet)))
    )
    return Grounded(lost, slid, pressure / count if count else math.nan)


@entry_kernel
def _grounded(force, point, of_foot, along, least, work):
    lost, slid, pressure, count = 0.0, 0.0, 0.0, 0
    load, place, way = work[0], work[1], work[2]
    for k in range(force.shape[0]):
        load[:] = 0.0
        place[:] = 0.0
        way[:] = 0.0
        for i in range(force.shape[1]):
            foot, normal = of_foot[i], force[k, i, 2]
            load[foot] += normal
            place[foot] += normal * along[i]
            if k + 1 < force.shape[0]:
                x, y = point[k + 1, i, 0] - point[k, i, 0], point[k + 1, i, 1] - point[k, i, 1]
                z = point[k + 1, i, 2] - point[k, i, 2]
                lost -= force[k, i, 0] * x + force[k, i, 1] * y + normal * z
                if normal != 0.0:
                    way[foot] += normal * math.sqrt(x * x + y * y)
        for foot in range(load.size):
            if load[foot] > least:
                pressure += place[foot] / load[foot]
                slid += way[foot] / load[foot]
                count += 1
    return lost, slid, pressure, count


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
