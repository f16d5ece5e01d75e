"""Sums over a span of rows that many metrics are made of, in compiled code; of every robot alike.

tests/measure/referee.py says the same in NumPy.
"""

import math
from typing import NamedTuple

import numpy as np

from biped.base.jit import entry_kernel
from biped.measure.contact import LOADED, along_feet
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY


class Driven(NamedTuple):
    """Sums over the actuators in a span.

    Attributes:
        net: [W] sum over the steps from row to row of |sum of mean powers|: torque times the mean of the rates before
            and after the step.
        absolute: [W] sum of all |mean powers|.
        positive: [W] sum of the positive ones.
        jumps: [N m] sum of the largest changes of a torque from row to row.
        saturated: Rows with a torque at its limit.
        torque: (nu,) [N m] sums of |torque|.
        squared: (nu,) [N² m²] sums of the torques' squares.
        most: (nu,) [N m] largest |torque|.
        power: (nu,) [W] largest |torque times rate| in a row.
    """

    net: float
    absolute: float
    positive: float
    jumps: float
    saturated: int
    torque: np.ndarray
    squared: np.ndarray
    most: np.ndarray
    power: np.ndarray


def driven(t: Trajectory, span: slice) -> Driven:
    """Sums what the actuators did in a span of rows."""
    each = np.zeros((4, len(t.robot.drives)))
    limit = np.array(t.torque_limit) * (1.0 - 1e-9)
    return Driven(*_driven(t.u[span], t.v[span], t.robot.columns, limit, *each), *each)


@entry_kernel
def _driven(u, v, columns, limit, torque, squared, most, power):
    net, absolute, positive, jumps, saturated = 0.0, 0.0, 0.0, 0.0, 0
    for k in range(u.shape[0]):
        total, jump, over = 0.0, 0.0, False
        for j in range(u.shape[1]):
            one, rate = u[k, j], v[k, columns[j]]
            size = abs(one)
            torque[j] += size
            squared[j] += one * one
            most[j] = max(most[j], size)
            power[j] = max(power[j], abs(one * rate))
            over |= size >= limit[j]
            if k + 1 < u.shape[0]:
                mean = one * 0.5 * (rate + v[k + 1, columns[j]])
                total += mean
                absolute += abs(mean)
                positive += max(mean, 0.0)
            if k > 0:
                jump = max(jump, abs(one - u[k - 1, j]))
        net += abs(total)
        jumps += jump
        saturated += over
    return net, absolute, positive, jumps, saturated


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
    """Sums what ground and feet did to each other in a span of rows."""
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
