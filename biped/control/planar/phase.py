"""Leg states of seven links (Fig 3.3), and the step back: when a step is being lost, a leg comes down behind.

The step back is not in the thesis, but made of its parts: a leg state from contacts and motion, and a couple of a
spring and a damper.
"""

import math

from biped.base.jit import inner_kernel
from biped.robot.gravity import GRAVITY
from biped.robot.leg_states import EXTENDED, FIRST_IN_AIR, leg_state
from biped.robot.planar.topology import HEEL, KNEE, LEGS, N_POINTS, THIGH, TOE, X, Z


@inner_kernel
def leg_states(c, q):
    """Writes the state of the right and the left leg (`biped.robot.leg_states.leg_state`) into the record."""
    memory, angle = c["memory"], c["at"]["angle"]
    for leg in range(LEGS):
        toe, heel = memory["believed"][TOE[leg]], memory["believed"][HEEL[leg]]
        thigh, other = angle[THIGH[leg]], angle[THIGH[1 - leg]]
        forward = thigh + 0.5 * math.pi + c["belief"]["tilt"]
        memory["phase"][leg] = leg_state(c["sensing"], toe, heel, thigh, other, forward, q[KNEE[leg]])


@inner_kernel
def step_back(c, q, v):
    """Writes whether the walker falls back into the record, and if so the extended state for legs in the air.

    It falls back while the torso's extrapolated centre of mass (Hof 2008), x + ẋ √(y/g) along the ground and taken
    vertically below the torso, is behind the rearmost believed contact by more than `margin`. (Places count from the
    torso's origin.)
    """
    memory = c["memory"]
    rear = math.inf
    for i in range(N_POINTS):
        if memory["believed"][i]:
            rear = min(rear, c["at"]["point"][i, 0])
    ahead = -q[Z] * math.tan(c["belief"]["tilt"]) + v[X] * math.sqrt(max(q[Z], 0.0) / GRAVITY)
    memory["back"] = ahead < rear - c["backstep"]["margin"] and rear < math.inf
    if memory["back"]:
        for leg in range(LEGS):
            if memory["phase"][leg] >= FIRST_IN_AIR:
                memory["phase"][leg] = EXTENDED
