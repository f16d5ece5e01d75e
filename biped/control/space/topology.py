"""In which order the law counts a biped with a free base: joints above the legs, the base's six, then each leg's six.

Joints that are neither the base's nor a leg's (waist, arms, head) come first, the outermost of the file first, those
that both legs hang on last. The base's velocities are linear ones along the world's axes and angular ones about its own
(MuJoCo's order). A leg's coordinates, right leg first, are three of the hip in the file's order, knee, ankle,
inversion; what a leg has not stands there as a mass of its own that nothing moves. A foot has four points.
"""

BASE = 6
"""Coordinates of a free base."""
LEGS = 2
LEG = 6
"""Coordinates of a leg, all driven."""
HIP_JOINTS = 3
"""The first coordinates of a leg turn its thigh."""
KNEE, ANKLE, INVERSION = range(HIP_JOINTS, LEG)
"""The others turn shank and foot."""
SIDE = (-1.0, 1.0)
"""Sign of y on the right and left: outward of a leg is `SIDE` times leftward."""

LEG_POINTS = 4
"""Corners of a sole: inner and outer toe, inner and outer heel."""
N_POINTS = LEGS * LEG_POINTS
"""Of both feet."""
TOE_END, HEEL_END = 0, 1
"""Numbers of a foot's ends."""
ENDS = 2 * LEGS
"""Toe and heel of the right and the left foot: an end touches if any of its two points does."""
