"""Where everything of a planar biped stands in its arrays: sizes, parents and places, each with a name.

A biped is a torso with two legs of three links. Links are the torso, then thigh, shank and foot of the first leg, then
of the second; coordinates x, z and pitch of the torso, then hip, knee and ankle of the first leg, then of the second;
contact points toe and heel of the first foot, then of the second; stops the first knee's, then the second's. This is
the canonical order: whatever order a model file has (`biped.robot.planar.description`), arrays and kernels have this
one. Compiled code takes these numbers in as constants.
"""

LEGS = 2
SEGMENTS = 3
"""Links of a leg, and joints: thigh on the hip, shank on the knee, foot on the ankle."""
ENDS = 2
"""Contact points of a foot: toe, heel."""
BASE = 3
"""Coordinates of the torso: x, z, pitch."""

NQ = BASE + LEGS * SEGMENTS
"""Coordinates, and velocities."""
NU = LEGS * SEGMENTS
"""Driven joints: all but the torso's."""
N_LINKS = 1 + LEGS * SEGMENTS
N_ANGLES = NQ - 2
"""Coordinates that are angles: all but x and z."""
N_POINTS = LEGS * ENDS
N_STOPS = LEGS
N_CONSTRAINTS = N_POINTS + N_STOPS
"""Constraints that may touch: the points, then the stops."""
STOP_ROW = 2 * N_POINTS
"""First row of A that is a stop's; before it stand the normal and the tangential row of each point."""
N_ROWS = STOP_ROW + N_STOPS
"""Rows of A with everything touching."""

X, Z, PITCH = 0, 1, 2
"""Coordinates of the torso."""
TORSO = 0
THIGH = tuple(1 + SEGMENTS * leg for leg in range(LEGS))
"""Links of the legs, by leg."""
SHANK = tuple(link + 1 for link in THIGH)
FOOT = tuple(link + 2 for link in THIGH)
HIP = tuple(BASE + SEGMENTS * leg for leg in range(LEGS))
"""Coordinates of the legs' joints, by leg."""
KNEE = tuple(joint + 1 for joint in HIP)
ANKLE = tuple(joint + 2 for joint in HIP)
TOE = tuple(ENDS * leg for leg in range(LEGS))
"""Contact points, by leg."""
HEEL = tuple(point + 1 for point in TOE)

LINK_DOF = PITCH
"""The joint of link k turns coordinate k + LINK_DOF."""
PARENT = (-1, *(TORSO if link in THIGH else link - 1 for link in range(1, N_LINKS)))
"""The link that each link hangs on."""
INWARD = (*(link for leg in range(LEGS) for link in range(FOOT[leg], TORSO + SEGMENTS * leg, -1)), TORSO)
"""Links in an order in which each comes after all that hang on it: leg by leg from the foot up, then the torso."""
CHAINS = tuple((TORSO, THIGH[leg], SHANK[leg], FOOT[leg]) for leg in range(LEGS))
"""Links from the torso to the foot, by leg."""
POINT_LEG = tuple(point // ENDS for point in range(N_POINTS))
POINT_LINK = tuple(FOOT[leg] for leg in POINT_LEG)

UPRIGHT = tuple(0.0 if link in FOOT else 0.5 for link in range(N_LINKS))
"""Absolute angle [half turns] of each link in the upright configuration with flat feet, in the thesis's sense."""
