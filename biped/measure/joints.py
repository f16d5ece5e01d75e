"""Ends of the feet and angles of the joints of any robot, as seen from the side.

Joint angles are the thesis's: hip θ1 − θ, knee θ2 − θ1 and ankle θ3 − θ2 + π/2, anticlockwise seen from the right.
Those of seven links are their coordinates; of other robots they are between trunk, thigh, shank and foot.
"""

from typing import Any

import numpy as np

from biped.measure.contact import along_feet
from biped.robot.planar.topology import ENDS, LEGS, SEGMENTS
from biped.robot.robot import Robot


def ends(robot: Robot, values: np.ndarray, of: Any = np.mean) -> np.ndarray:
    """(n, 4, …) toe and heel of each foot: means, or what `of` makes, of values (n, P, …) of the halves of its points.

    Args:
        robot: Whose feet.
        values: Of its contact points.
        of: Reduces an array over its axis 1.
    """
    along, feet, parts = along_feet(robot), robot.of_foot, []
    for foot in range(len(robot.feet)):
        mine = feet == foot
        front, rear = mine & (along >= 0.5), mine & (along < 0.5)
        parts += [of(values[:, half if half.any() else mine], axis=1) for half in (front, rear)]
    return np.stack(parts, axis=1)


def joint_angles(figure: np.ndarray, end: np.ndarray, trunk: np.ndarray) -> np.ndarray:
    """(n, 6) [rad] of hip, knee and ankle; right, then left.

    Args:
        figure: (n, 7, 3) [m] hip, knee and ankle of each leg, and the trunk's upper end.
        end: (n, 4, 3) [m] toe and heel of each foot.
        trunk: (n,) [rad] of the trunk from the ground's normal, anticlockwise.
    """
    joint, point = figure[..., [0, 2]], end[..., [0, 2]]
    out = np.empty((len(figure), LEGS * SEGMENTS))
    for leg in range(LEGS):
        first = SEGMENTS * leg
        hip, knee, ankle = (joint[:, first + i] for i in range(SEGMENTS))
        toe, heel = point[:, ENDS * leg], point[:, ENDS * leg + 1]
        thigh, shank = _slant(hip - knee), _slant(knee - ankle)
        foot = np.unwrap(np.arctan2((toe - heel)[:, 1], (toe - heel)[:, 0]))
        out[:, first], out[:, first + 1], out[:, first + 2] = thigh - trunk, shank - thigh, foot - shank
    return out


def _slant(along: np.ndarray) -> np.ndarray:
    """(n,) [rad] of vectors (n, 2) from upright, anticlockwise positive."""
    return np.unwrap(np.arctan2(-along[:, 0], along[:, 1]))
