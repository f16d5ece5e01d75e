"""Time series that people look at, derived from a trajectory; recordings and figures show the same ones."""

import math

import numpy as np

from biped.base.typed import LARGEST
from biped.measure.contact import along_feet, ends
from biped.measure.trajectory import Trajectory
from biped.robot.ground import GRAVITY
from biped.robot.leg_states import FIRST_IN_AIR
from biped.robot.planar.topology import ENDS, LEGS, SEGMENTS

# Before this distance [m] the cost of transport is a number divided by almost nothing.
_STARTED = 0.5
SMOOTH = 0.02
"""[s] of means that the eye can follow: contacts hit and miss many times in a step, and torques with them."""


def finite(trajectory: Trajectory) -> Trajectory:
    """The trajectory without the rows in which a diverging run is no longer finite."""
    return trajectory.rows(trajectory.sound)


def toes_and_heels(t: Trajectory) -> np.ndarray:
    """(n, 4, 3) [m] in the slope's frame."""
    return ends(t.robot, t.point)


def end_forces(t: Trajectory) -> np.ndarray:
    """(n, 4, 3) [N] ground forces on toes and heels."""
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


def joint_limits(t: Trajectory) -> np.ndarray:
    """(6,) [N m] limits of the joint torques; infinite where there is none."""
    out = np.full(LEGS * SEGMENTS, math.inf)
    for joint, drive in t.robot.pitching_drives:
        if t.torque_limit[drive] < LARGEST:
            out[joint] = t.torque_limit[drive]
    return out


def joint_power(t: Trajectory) -> np.ndarray:
    """(n, 6) [W] power into hip, knee and ankle; right, then left."""
    return t.joint_torques * t.joint_rates


def cost_of_transport(t: Trajectory) -> np.ndarray:
    """(n,) net cost of transport since the start, ∫|Σ powers| dt / (m g d); nan in the first half metre.

    Powers are of all that acts, the torso's share of generalized forces included; d is along the ground.
    """
    work = np.concatenate([[0.0], np.cumsum(np.abs(t.net_power))]) * t.tick
    distance = np.hypot(t.x - t.x[0], t.y - t.y[0])
    far = np.where(distance < _STARTED, np.nan, distance)
    return work / (t.mass * GRAVITY * far)


def leg_states(t: Trajectory) -> np.ndarray:
    """(n, 2) leg states to be drawn: those that the law believed in, or whether a foot is on the ground.

    A law believes nothing any more in the row in which its walker has fallen.
    """
    states, true = t.believed_states, np.where(t.down, 1.0, float(FIRST_IN_AIR + 1))
    return true if states is None else np.where(np.isfinite(states), states, true)


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
