"""Time series that people look at, derived from a trajectory; recordings and figures show the same ones.

The thesis's joint angles need no deriving: hip θ1 − θ, knee θ2 − θ1 and ankle θ3 − θ2 + π/2 are q[:, 3:].
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from biped.measure.trajectory import Trajectory
from biped.robot.gravity import GRAVITY
from biped.robot.planar.topology import BASE, CHAINS, ENDS, HEEL, LEGS, PITCH, TOE
from biped.robot.planar.tree import motion

if TYPE_CHECKING:
    from biped.measure.stored import AnyTrajectory

_COM = 0.626
"""Where the thesis's torso has its centre of mass, of its length from the hip."""
# Before this distance [m] the cost of transport is a number divided by almost nothing.
_STARTED = 0.5
SMOOTH = 0.02
"""[s] of means that the eye can follow: contacts hit and miss many times in a step, and torques with them."""


def finite(trajectory: Any) -> Any:
    """The trajectory without the rows in which a diverging run is no longer finite."""
    return trajectory.rows(trajectory.sound)


def seen(trajectory: AnyTrajectory) -> Trajectory:
    """What curves and figures are drawn of: a planar robot's run itself, another's as it is seen from its side."""
    if isinstance(trajectory, Trajectory):
        return trajectory
    from biped.measure.general.sagittal import sagittal

    return cast(Trajectory, sagittal(trajectory))


def stick(trajectory: Trajectory, rows: np.ndarray) -> np.ndarray:
    """(m, 12, 2) [m] hip, knee, ankle, toe, heel of each leg, the trunk's upper end, the centre of mass."""
    if not isinstance(trajectory, Trajectory):
        return trajectory.place[rows]
    pose = motion(trajectory.tree, trajectory.q[rows], trajectory.v[rows])
    parts = []
    for leg in range(LEGS):
        hip, knee, ankle = CHAINS[leg][1:]
        parts += [pose.joint[:, hip], pose.joint[:, knee], pose.joint[:, ankle]]
        parts += [pose.point[:, TOE[leg]], pose.point[:, HEEL[leg]]]
    middle = 0.5 * (parts[0] + parts[len(parts) // 2])
    return np.stack([*parts, middle + (pose.com[:, 0] - middle) / _COM, centre_of_mass(trajectory)[rows]], axis=1)


def corners_of(trajectory: Trajectory) -> np.ndarray:
    """(4, 2) [m] corners of what a run can sit on, along and normal to the ground; (0, 2) without a seat."""
    seat = trajectory.seat
    if seat is None:
        return np.empty((0, 2))
    front, back = seat.front, seat.front - seat.depth
    return np.array([(back, 0.0), (back, seat.height), (front, seat.height), (front, 0.0)])


def limbs(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints (n, 7, 2) of the links, toes and heels (n, 4, 2), and the torso's upper end (n, 2) [m]."""
    if not isinstance(trajectory, Trajectory):
        place = trajectory.place
        return place[:, [0, 0, 1, 2, 5, 6, 7]], place[:, [3, 4, 8, 9]], place[:, 10]
    pose, share = motion(trajectory.tree, trajectory.q, trajectory.v), trajectory.robot.shown.com
    return pose.joint, pose.point, pose.joint[:, 1] + (pose.com[:, 0] - pose.joint[:, 1]) / share


def every(trajectory: AnyTrajectory, rate: float) -> np.ndarray:
    """Row numbers (m,) that show a trajectory at about `rate` [Hz], the first one included."""
    return np.arange(0, len(trajectory), max(1, round(1.0 / (rate * trajectory.tick))))


def torso_angle(trajectory: Trajectory) -> np.ndarray:
    """(n,) [rad] θ from the horizontal, not from the slope: π/2 is upright."""
    return trajectory.q[:, PITCH] + 0.5 * math.pi + math.radians(trajectory.slope)


def inferred_torso_angle(trajectory: Trajectory) -> np.ndarray | None:
    """(n,) [rad] what an estimator made of it; None without one."""
    if trajectory.inferred is None:
        return None
    return trajectory.inferred[:, 0] + 0.5 * math.pi + math.radians(trajectory.slope)


def centre_of_mass(trajectory: Trajectory) -> np.ndarray:
    """(n, 2) [m] centre of mass of the whole biped in the slope's frame."""
    if not isinstance(trajectory, Trajectory):
        return trajectory.place[:, 11]
    mass = trajectory.tree.mass
    return np.tensordot(motion(trajectory.tree, trajectory.q, trajectory.v).com, mass / mass.sum(), (1, 0))


def centre_velocity(trajectory: Trajectory) -> np.ndarray:
    """(n, 2) [m/s] its velocity."""
    if not isinstance(trajectory, Trajectory):
        return trajectory.com_velocity
    share = trajectory.tree.mass / trajectory.tree.mass.sum()
    return np.tensordot(motion(trajectory.tree, trajectory.q, trajectory.v).com_velocity, share, (1, 0))


def toes_and_heels(trajectory: Trajectory) -> np.ndarray:
    """(n, 4, 2) [m] in the slope's frame."""
    return limbs(trajectory)[1]


def joint_power(trajectory: Trajectory) -> np.ndarray:
    """(n, 6) [W] power into hip, knee and ankle; right, then left."""
    return (trajectory.applied * trajectory.v)[:, BASE:]


def cost_of_transport(trajectory: Trajectory) -> np.ndarray:
    """(n,) net cost of transport since the start, ∫|Σ powers| dt / (m g d); nan in the first half metre.

    Powers are of all that acts, the torso's share of generalized forces included; d is along the ground.
    """
    power = np.abs((trajectory.applied * trajectory.v).sum(axis=1))
    work = np.concatenate([[0.0], np.cumsum(power[:-1])]) * trajectory.tick
    distance = trajectory.q[:, 0] - trajectory.q[0, 0]
    far = np.where(np.abs(distance) < _STARTED, np.nan, np.abs(distance))
    return work / (float(trajectory.tree.mass.sum()) * GRAVITY * far)


def means(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(m, …) means of values (n, …) from each of rows (m,) to the next.

    Contacts, and torques with them, come and go from tick to tick: a mean keeps the impulse, but a sample of
    every second tick may show twice the force or none.
    """
    count = np.diff(np.append(rows, len(values)))
    return np.add.reduceat(values, rows, axis=0) / count.reshape(-1, *(1,) * (values.ndim - 1))


def foot_force(trajectory: Trajectory) -> np.ndarray:
    """(n, 2) [N] normal force under the right and the left foot."""
    return trajectory.force[:, :, 1].reshape(-1, LEGS, ENDS).sum(axis=2)


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
