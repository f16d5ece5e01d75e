"""Gravity, in the frame that the plane of motion is fixed to."""

from __future__ import annotations

import math

GRAVITY = 9.81
"""[m/s²]"""


def gravity(slope: float) -> tuple[float, float]:
    """Gravity (x, z) [m/s²] in the frame of a slope [degrees]."""
    return -GRAVITY * math.sin(math.radians(slope)), -GRAVITY * math.cos(math.radians(slope))
