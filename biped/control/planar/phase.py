"""The four leg states (Fig 3.3): memoryless, from the believed contacts and the leg's configuration."""

from __future__ import annotations

import math

from biped.base.jit import inner_kernel
from biped.robot.leg_states import EXTENDED, PUSH_OFF, STANCE, SWING
from biped.robot.planar.topology import HEEL, KNEE, LEGS, THIGH, TOE


@inner_kernel
def leg_states(c, q):
    """Writes the state of the right and the left leg (an index of `biped.robot.leg_states`) into the record.

    1 heel on the ground; 2 toe only; 3 in the air; 4 in the air with the knee extended and the thigh ahead of the
    other by `ahead`. A toe-only leg whose thigh still points further forward than `late_stance` has only just landed:
    state 1. One that has not, but passes the other by more than `passing`, drags its toe: state 3.
    """
    memory, sensing = c["memory"], c["sensing"]
    angle = c["at"]["angle"]
    for leg in range(LEGS):
        toe, heel = memory["believed"][TOE[leg]], memory["believed"][HEEL[leg]]
        thigh, other = angle[THIGH[leg]], angle[THIGH[1 - leg]]
        if heel:
            state = STANCE
        elif toe:
            if thigh + 0.5 * math.pi + c["belief"]["tilt"] > sensing["late_stance"]:
                state = STANCE
            else:
                state = SWING if thigh - other > sensing["passing"] else PUSH_OFF
        elif q[KNEE[leg]] > -sensing["extended"] and thigh - other > sensing["ahead"]:
            state = EXTENDED
        else:
            state = SWING
        memory["phase"][leg] = state
