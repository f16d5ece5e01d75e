"""The judge of a fall: the trunk is too low above the ground, or leans too far from the vertical.

The same for every robot and engine, and of the true state alone: what a law senses, believes or measures angles from
has no part in it. Kernels judge: `biped.engines.row` of any robot, `biped.engines.planar.tick` of seven links,
`biped.engines.space.walk` of the compiled free base; statuses and words are the same for all.
"""

import numpy as np

GOING, LOW, TILTED, NOT_FINITE, RAISED = 0, 1, 2, 3, 4
"""Statuses of a tick: the run goes on, the trunk is too low, it leans too far, a number is not finite, a law failed."""

_STILL = 0.2
"""[m/s] below which a fall has no direction."""


def fall_words(way: np.ndarray, time: float) -> str:
    """Where a robot fell to, and when.

    Args:
        way: (2,) or longer: forward and to the left, of the trunk's axis where it leaned too far, otherwise of the
            velocity [m/s]: a trunk that is held upright over toppling legs falls the way it moves.
        time: [s].
    """
    forward, left = way[:2]
    if max(abs(forward), abs(left)) < _STILL:
        return f"collapsed at {time:.3f} s"
    if abs(left) > abs(forward):
        return f"fell to the {'left' if left > 0.0 else 'right'} at {time:.3f} s"
    return f"fell {'forward' if forward > 0.0 else 'backward'} at {time:.3f} s"
