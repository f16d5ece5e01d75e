"""The four leg states (Fig 3.3) of feet with four points: toe or heel is on the ground if any of its two points is."""

from __future__ import annotations

from biped.base.jit import inner_kernel
from biped.control.space.topology import HEEL_END, KNEE, LEGS, TOE_END
from biped.robot.leg_states import EXTENDED, PUSH_OFF, STANCE, SWING


@inner_kernel
def leg_states(c):
    """Writes the states of both legs into the record, as `biped.control.planar.phase.leg_states` does."""
    memory, sensing, angle, joint = c["memory"], c["sensing"], c["at"]["angle"], c["at"]["joint"]
    for leg in range(LEGS):
        toe, heel = memory["believed"][2 * leg + TOE_END], memory["believed"][2 * leg + HEEL_END]
        thigh, other = angle[leg, 0], angle[1 - leg, 0]
        if heel:
            state = STANCE
        elif toe:
            if thigh > sensing["late_stance"]:
                state = STANCE
            else:
                state = SWING if thigh - other > sensing["passing"] else PUSH_OFF
        elif joint[leg, KNEE] > -sensing["extended"] and thigh - other > sensing["ahead"]:
            state = EXTENDED
        else:
            state = SWING
        memory["phase"][leg] = state
