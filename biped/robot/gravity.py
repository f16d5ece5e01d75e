"""Gravity and the ground's frame, which everything is in."""

import math

import numpy as np

GRAVITY = 9.81
"""[m/s²]"""


def gravity(slope: float) -> tuple[float, float]:
    """Gravity in the frame of a slope, in the plane.

    Args:
        slope: [degrees] by which the ground rises forward.

    Returns:
        Its parts along the ground and out of it [m/s²].
    """
    return -GRAVITY * math.sin(math.radians(slope)), -GRAVITY * math.cos(math.radians(slope))


def frame(slope: float, side_slope: float) -> np.ndarray:
    """(3, 3) from the world, whose z is up, to the ground's frame: rows are its axes; angles in degrees.

    The ground rises by tan(slope) forward and by tan(side_slope) to the left; its x is the steepest part of forward.
    """
    forward = np.array([math.cos(math.radians(slope)), 0.0, math.sin(math.radians(slope))])
    normal = np.array([-math.tan(math.radians(slope)), -math.tan(math.radians(side_slope)), 1.0])
    normal /= np.linalg.norm(normal)
    return np.array([forward, np.cross(normal, forward), normal])


def gravity3(slope: float, side_slope: float) -> np.ndarray:
    """(3,) gravity [m/s²] in the ground's frame; angles in degrees."""
    return frame(slope, side_slope) @ np.array([0.0, 0.0, -GRAVITY])
