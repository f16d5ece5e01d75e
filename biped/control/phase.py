"""The four leg states (Fig 3.3): memoryless, from the believed contacts and the leg's configuration."""

from __future__ import annotations

import math

from biped.base.jit import kernel

STANCE, PUSH_OFF, SWING, EXTENDED = 0, 1, 2, 3
"""Indices of leg states 1 … 4."""


@kernel
def leg_states(c, q):
    """Writes the state of the right and the left leg (0 … 3 for states 1 … 4) into the record.

    1 heel on the ground; 2 toe only; 3 in the air; 4 in the air with the knee extended and the thigh ahead of the
    other by `ahead`. A toe-only leg whose thigh still points further forward than `late_stance` has only just landed:
    state 1.
    """
    angle = c["angle"]
    for leg in range(2):
        toe, heel = c["believed"][2 * leg], c["believed"][2 * leg + 1]
        thigh, other = angle[1 + 3 * leg], angle[4 - 3 * leg]
        if heel:
            state = 0
        elif toe:
            state = 0 if thigh + 0.5 * math.pi + c["tilt"] > c["late_stance"] else 1
        elif q[4 + 3 * leg] > -c["extended"] and thigh - other > c["ahead"]:
            state = 3
        else:
            state = 2
        c["phase"][leg] = state
