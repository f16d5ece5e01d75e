"""The four leg states (Fig 3.3) as kernels and logs number them, and the one that a leg is in: it has no memory.

Index 0 … 3 is leg state 1 … 4 of the thesis; gains are given in this order, and a log holds the index plus one.
"""

from biped.base.jit import inner_kernel

STANCE, PUSH_OFF, SWING, EXTENDED = 0, 1, 2, 3
"""Heel on the ground; toe only; in the air; in the air with the knee extended and the thigh ahead."""
STATES = 4
FIRST_IN_AIR = SWING
"""From this index on a leg is in the air."""


@inner_kernel
def leg_state(sensing, toe, heel, thigh, other, forward, knee):
    """Returns the index of a leg's state.

    1 heel on the ground; 2 toe only; 3 in the air; 4 in the air with the knee extended and the thigh ahead of the
    other by `ahead`. A toe-only leg whose thigh still points further forward than `late_stance` has only just landed:
    state 1. One that has not, but passes the other by more than `passing`, drags its toe: state 3. (Below 0 one that is
    still behind by less: a walker that has come to a stand on both feet takes its rear foot off.)

    Args:
        sensing: The scenario's thresholds.
        toe: Whether the toe is on the ground.
        heel: Whether the heel is.
        thigh: [rad] of the thigh.
        other: [rad] of the other thigh, likewise.
        forward: [rad] of the thigh from straight down, forward positive.
        knee: [rad] coordinate of the knee, 0 extended.
    """
    if heel:
        return STANCE
    if toe:
        if forward > sensing["late_stance"]:
            return STANCE
        return SWING if thigh - other > sensing["passing"] else PUSH_OFF
    extended = knee > -sensing["extended"] and thigh - other > sensing["ahead"]
    return EXTENDED if extended else SWING
