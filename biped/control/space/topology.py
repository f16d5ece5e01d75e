"""Coordinates of a biped with a free base: six of the base, then six of each leg, right first.

Velocities of the base are linear ones along the world's axes and angular ones about the torso's own (MuJoCo's order);
a leg's coordinates are hip flexion, abduction, rotation, knee, ankle, inversion. A foot has four points.
"""

from __future__ import annotations

N = 18
"""Degrees of freedom."""
BASE = 6
LEGS = 2
LEG = 6
"""Coordinates of a leg, all driven."""
NU = LEGS * LEG
FLEXION, ABDUCTION, ROTATION, KNEE, ANKLE, INVERSION = range(LEG)
HIP_JOINTS = 3
"""The first coordinates of a leg turn its thigh."""
SIDE = (-1.0, 1.0)
"""Sign of y on the right and left: outward of a leg is `SIDE` times leftward."""

TORSO = 0
THIGH, SHANK, FOOT = (1, 4), (2, 5), (3, 6)
BODIES = 7
"""Links in the model's order: torso, right thigh, shank, foot, left thigh, shank, foot."""

LEG_POINTS = 4
"""Inner and outer toe, inner and outer heel."""
N_POINTS = LEGS * LEG_POINTS
TOE_END, HEEL_END = 0, 1
ENDS = 2 * LEGS
"""Toe and heel of the right and the left foot: an end touches if any of its two points does."""
