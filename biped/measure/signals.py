"""Time series that people look at, derived from a trajectory; recordings and figures show the same ones.

Joint angles are the thesis's: hip θ1 − θ, knee θ2 − θ1 and ankle θ3 − θ2 + π/2, anticlockwise seen from the right.
Those of seven links are their coordinates; of other robots they are between trunk, thigh, shank and foot, as seen
from the side.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from biped.measure.contact import along_feet
from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY
from biped.robot.leg_states import FIRST_IN_AIR
from biped.robot.planar.topology import BASE, ENDS, LEGS, SEGMENTS

# Before this distance [m] the cost of transport is a number divided by almost nothing.
_STARTED = 0.5
SMOOTH = 0.02
"""[s] of means that the eye can follow: contacts hit and miss many times in a step, and torques with them."""


def finite(trajectory: Trajectory) -> Trajectory:
    """The trajectory without the rows in which a diverging run is no longer finite."""
    return trajectory.rows(trajectory.sound)


def ends(t: Trajectory, values: np.ndarray, of: Any = np.mean) -> np.ndarray:
    """(n, 4, …) toe and heel of each foot: means, or what `of` makes, of values (n, P, …) of the halves of its points.

    Args:
        t: The run.
        values: Of its contact points.
        of: Reduces an array over its axis 1.
    """
    along, feet, parts = along_feet(t.robot), t.robot.of_foot, []
    for foot in range(len(t.robot.feet)):
        mine = feet == foot
        front, rear = mine & (along >= 0.5), mine & (along < 0.5)
        parts += [of(values[:, half if half.any() else mine], axis=1) for half in (front, rear)]
    return np.stack(parts, axis=1)


def toes_and_heels(t: Trajectory) -> np.ndarray:
    """(n, 4, 3) [m] in the slope's frame."""
    return ends(t, t.point)


def end_forces(t: Trajectory) -> np.ndarray:
    """(n, 4, 3) [N] ground forces on toes and heels."""
    if t.robot.seven_links is not None:
        return t.force
    along, feet = along_feet(t.robot) >= 0.5, t.robot.of_foot
    halves = [(feet == foot) & (along == front) for foot in range(LEGS) for front in (True, False)]
    return np.stack([t.force[:, half].sum(axis=1) for half in halves], axis=1)


def stick(t: Trajectory, rows: np.ndarray) -> np.ndarray:
    """(m, 12, 3) [m] hip, knee, ankle, toe, heel of each leg, the trunk's upper end, the centre of mass."""
    some = t.rows(rows)
    figure, point, parts = some.figure, toes_and_heels(some), []
    for leg in range(LEGS):
        parts += [figure[:, SEGMENTS * leg : SEGMENTS * (leg + 1)], point[:, ENDS * leg : ENDS * (leg + 1)]]
    return np.concatenate([*parts, figure[:, -1:], some.com[:, None]], axis=1)


def corners_of(trajectory: Trajectory) -> np.ndarray:
    """(4, 2) [m] corners of what a run can sit on, along and normal to the ground; (0, 2) without a seat."""
    seat = trajectory.seat
    if seat is None:
        return np.empty((0, 2))
    front, back = seat.front, seat.front - seat.depth
    return np.array([(back, 0.0), (back, seat.height), (front, seat.height), (front, 0.0)])


def limbs(t: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints (n, 7, 2) of the links, toes and heels (n, 4, 2), and the torso's upper end (n, 2) [m]; from the side."""
    figure = t.figure[..., [0, 2]]
    return figure[:, [0, 0, 1, 2, 3, 4, 5]], toes_and_heels(t)[..., [0, 2]], figure[:, 6]


def every(trajectory: Trajectory, rate: float) -> np.ndarray:
    """Row numbers (m,) that show a trajectory at about `rate` [Hz], the first one included."""
    return np.arange(0, len(trajectory), max(1, round(1.0 / (rate * trajectory.tick))))


def torso_angle(t: Trajectory) -> np.ndarray:
    """(n,) [rad] θ from the horizontal, not from the slope: π/2 is upright."""
    return 0.5 * math.pi - t.lean


def inferred_torso_angle(trajectory: Trajectory) -> np.ndarray | None:
    """(n,) [rad] what an estimator made of it; None without one."""
    if trajectory.inferred is None:
        return None
    return trajectory.inferred[:, 0] + 0.5 * math.pi + math.radians(trajectory.slope)


def joint_angles(t: Trajectory) -> np.ndarray:
    """(n, 6) [rad] of hip, knee and ankle; right, then left."""
    if t.robot.seven_links is not None:
        return t.q[:, BASE:]
    joint, point, _ = limbs(t)
    trunk = -t.lean - math.radians(t.slope)
    out = np.empty((len(t), LEGS * SEGMENTS))
    for leg in range(LEGS):
        hip, knee, ankle = (joint[:, 1 + SEGMENTS * leg + i] for i in range(SEGMENTS))
        toe, heel = point[:, ENDS * leg], point[:, ENDS * leg + 1]
        thigh, shank = _slant(hip - knee), _slant(knee - ankle)
        foot = np.unwrap(np.arctan2((toe - heel)[:, 1], (toe - heel)[:, 0]))
        first = SEGMENTS * leg
        out[:, first], out[:, first + 1], out[:, first + 2] = thigh - trunk, shank - thigh, foot - shank
    return out


def _slant(along: np.ndarray) -> np.ndarray:
    """(n,) [rad] of vectors (n, 2) from upright, anticlockwise positive."""
    return np.unwrap(np.arctan2(-along[:, 0], along[:, 1]))


def joint_rates(t: Trajectory) -> np.ndarray:
    """(n, 6) [rad/s] of the joint angles."""
    if t.robot.seven_links is not None:
        return t.v[:, BASE:]
    angles = joint_angles(t)
    return np.gradient(angles, t.tick, axis=0) if len(t) > 1 else np.zeros_like(angles)


def joint_torques(t: Trajectory) -> np.ndarray:
    """(n, 6) [N m] that act on the joint angles: of the drives that turn hip, knee and ankle in the way's plane."""
    if t.robot.seven_links is not None:
        return t.applied[:, BASE:]
    out = np.zeros((len(t), LEGS * SEGMENTS))
    for column, drive in _pitching(t):
        out[:, column] = t.robot.drives[drive].turns * t.u[:, drive]
    return out


def joint_limits(t: Trajectory) -> np.ndarray:
    """(6,) [N m] limits of these torques; infinite where there is none."""
    if t.robot.seven_links is not None:
        return np.array(t.torque_limit)
    out = np.full(LEGS * SEGMENTS, math.inf)
    for column, drive in _pitching(t):
        if t.robot.drives[drive].limited:
            out[column] = t.torque_limit[drive]
    return out


def _pitching(t: Trajectory) -> list[tuple[int, int]]:
    """(number among the six joints, number of the drive) of those that drive hip, knee and ankle."""
    if t.generalized:
        return []
    return [
        (SEGMENTS * leg + i, k)
        for leg, foot in enumerate(t.robot.feet) for i, name in enumerate(foot.pitching)
        for k, drive in enumerate(t.robot.drives) if drive.joint == name
    ]  # fmt: skip


def joint_power(t: Trajectory) -> np.ndarray:
    """(n, 6) [W] power into hip, knee and ankle; right, then left."""
    return joint_torques(t) * joint_rates(t)


def cost_of_transport(t: Trajectory) -> np.ndarray:
    """(n,) net cost of transport since the start, ∫|Σ powers| dt / (m g d); nan in the first half metre.

    Powers are of all that acts, the torso's share of generalized forces included; d is along the ground.
    """
    if t.robot.seven_links is not None:
        power = np.abs((t.applied * t.v).sum(axis=1))
    else:
        power = np.abs(t.input_work / t.tick if t.generalized else (t.u * t.rate).sum(axis=1))
    work = np.concatenate([[0.0], np.cumsum(power[:-1])]) * t.tick
    distance = np.abs(t.x - t.x[0])
    far = np.where(distance < _STARTED, np.nan, distance)
    return work / (t.mass * GRAVITY * far)


def leg_states(t: Trajectory) -> np.ndarray:
    """(n, 2) leg states to be drawn: those that the law believed in, or whether a foot is on the ground."""
    states = t.believed_states
    return np.where(t.down, 1.0, float(FIRST_IN_AIR + 1)) if states is None else states


def means(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(m, …) means of values (n, …) from each of rows (m,) to the next.

    Contacts, and torques with them, come and go from tick to tick: a mean keeps the impulse, but a sample of
    every second tick may show twice the force or none.
    """
    count = np.diff(np.append(rows, len(values)))
    return np.add.reduceat(values, rows, axis=0) / count.reshape(-1, *(1,) * (values.ndim - 1))


def inside(trajectory: Trajectory, window: tuple[float, float]) -> np.ndarray:
    """(n,) whether a row is in the window [s]; all are if the run ended before it."""
    rows = (trajectory.time >= window[0]) & (trajectory.time <= window[1])
    return rows if rows.sum() > 1 else np.ones_like(rows)


def smooth(values: np.ndarray, tick: float) -> np.ndarray:
    """(n,) moving means of values (n,) that are `tick` [s] apart; at the ends, of what there is."""
    window = np.ones(max(1, round(SMOOTH / tick)))
    count = np.convolve(np.ones(len(values)), window)
    first = (len(window) - 1) // 2
    return (np.convolve(values, window) / count)[first : first + len(values)]
