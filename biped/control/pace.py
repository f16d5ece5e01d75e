"""How legs follow the walker's speed, thighs and torso slopes (`biped.scenario.gains.Pace`), in the plane and in space.

Springs and dampers alone do not know how fast the walker is, so that it runs away from a push behind it.
"""

from typing import Any

from biped.base.jit import inner_kernel
from biped.robot.leg_states import EXTENDED, PUSH_OFF, SWING
from biped.scenario.gains import Pace

PARTS = len(Pace.__struct_fields__)
"""Numbers of a pace in a controller record: speed, slope, side, swing, stance, lean, knee, ankle."""


def parts(pace: Pace | None) -> tuple[Any, ...]:
    """The numbers of a complete pace, in the record's order; 0 where there is none."""
    return tuple(getattr(pace, name) or 0.0 for name in Pace.__struct_fields__) if pace else (0.0,) * PARTS


@inner_kernel
def excess(pace, speed, rise):
    """[m/s] by which a walker is faster forward than its pace v0.

    Args:
        pace: (8,) as `parts` has it.
        speed: [m/s] of the centre of mass, forward.
        rise: [rad] by which the ground rises ahead, as the law knows it.
    """
    return speed - pace[0] + pace[1] * rise


@inner_kernel
def flexed(pace, state, faster):
    """[rad] by which a leg in a state (0 … 3) is flexed further where the walker is faster by so much [m/s]."""
    return pace[3 if state in (SWING, EXTENDED) else 4] * faster


@inner_kernel
def leaned(pace, rise):
    """[rad] by which the torso leans further forward where the ground rises ahead; downhill it does not lean back."""
    return pace[5] * max(rise, 0.0)


@inner_kernel
def straightened(pace, state, faster):
    """[N m] that straighten a leg's knee in a state (0 … 3): of one in the air, where the walker is faster.

    They grow with the square of the excess, as the couple does by which a faster thigh bends the knee.
    """
    if state in (SWING, EXTENDED):
        above = max(faster, 0.0)
        return pace[6] * above * above
    return 0.0


@inner_kernel
def extended(pace, state, faster, rise):
    """[N m] that extend a leg's ankle in a state (0 … 3): of one that pushes off, where the walker is too slow.

    They are largest where it has nearly come to a stand, and vanish at the pace v0 and, so that a walker that is pushed
    back is not helped over backward, at -v0.
    """
    v0 = pace[0] - pace[1] * rise
    if state == PUSH_OFF and -2.0 * v0 < faster < 0.0:
        return pace[7] * faster * faster * (2.0 + faster / v0)
    return 0.0
