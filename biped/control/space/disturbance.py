"""A push to a side, as the law notices it: by an acceleration that gravity and its own ground forces do not explain.

A foot is placed by the velocity of the centre of mass. While a push lasts, that velocity lags behind it: a foot that
lands before the push has ended lands too far inward. The law knows the forces that it expected of the ground in the
latest tick, so how the centre of mass has speeded up since shows what else pushes. It needs no sensor of its own.
"""

from biped.base.jit import inner_kernel
from biped.control.space.places import headed
from biped.control.space.record import EDGES, N_POINTS
from biped.robot.ground import GRAVITY

NOTICED = 0.015
"""[s] Time constant with which a push is noticed: the ground's own impacts are as large, and shorter."""


@inner_kernel
def notice_push(c, first):
    """Brings the record's memory of what pushes the walker to its left [m/s²] on by a tick.

    A tick counts as no more than g: what is more is an impact.

    Args:
        c: The controller record, with sensed places and the ground forces of the latest tick.
        first: Whether this is the run's first tick, before which nothing is known.
    """
    at, memory, act, force = c["at"], c["memory"], c["actuation"], c["tick"]["force"]
    _, leftward = headed(c, at["com_velocity"][0], at["com_velocity"][1])
    if not first and act["generalized"] == 0:
        x, y, mu = 0.0, 0.0, act["friction"] / c["belief"]["mass"]
        for k in range(0, N_POINTS * EDGES, EDGES):
            x += mu * (force[k] - force[k + 1])
            y += mu * (force[k + 2] - force[k + 3])
        downhill = c["belief"]["downhill"]
        _, explained = headed(c, x + downhill[0], y + downhill[1])
        more = (leftward - memory["leftward"]) / act["tick"] - explained
        memory["pushed"] += act["noticing"] * (min(max(more, -GRAVITY), GRAVITY) - memory["pushed"])
    memory["leftward"] = leftward
