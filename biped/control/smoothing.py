"""Torques that go to what is asked for with a time constant, instead of at once.

Of a first-order lag of the actuators the law knows nothing; of this one it does, and every torque it asks for is one
that it means.
"""

import math

from biped.base.jit import kernel


def fraction(time_constant: float, tick: float) -> float:
    """The fraction of its way that a first-order lag goes in a tick.

    Args:
        time_constant: [s]; 0: at once.
        tick: [s].

    Returns:
        1 - exp(-tick / time_constant).
    """
    return 1.0 - math.exp(-tick / time_constant) if time_constant > 0.0 else 1.0


@kernel
def smooth(u, latest, follow, first):
    """Takes torques a fraction of the way from the latest ones to those asked for, in place.

    Both are within the torque limits, so what lies between is.

    Args:
        u: (n,) torques asked for [N m].
        latest: (n,) of the tick before; remembers the new ones.
        follow: The fraction, from `fraction`.
        first: Whether this is the run's first tick, in which torques are those asked for.
    """
    for j in range(u.size):
        if follow < 1.0 and not first:
            u[j] = latest[j] + follow * (u[j] - latest[j])
        latest[j] = u[j]
