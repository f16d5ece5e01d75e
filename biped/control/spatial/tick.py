"""One control tick of a biped with a free base: sense, decide the leg states, Q_d, joint torques."""

from __future__ import annotations

import math

from biped.base.jit import kernel
from biped.control.spatial.phase import leg_states
from biped.control.spatial.places import believe_contacts, point_motion, sense_places
from biped.control.spatial.pushing import pushing_torques
from biped.control.spatial.springs import desired_forces
from biped.control.spatial.topology import N
from biped.control.tick import GOING, LOW, NOT_FINITE, TILTED


@kernel
def fallen(c, m):
    """Whether a state is one in which a run ends: GOING, LOW, TILTED or NOT_FINITE."""
    for j in range(N):
        if not (math.isfinite(m.q[j]) and math.isfinite(m.v[j])):
            return NOT_FINITE
    fall = c["fall"]
    if m.q[2] < fall["height"]:
        return LOW
    if m.turned[1, 8] < math.cos(fall["tilt"]):
        return TILTED
    return GOING


@kernel
def spatial_tick(record, m, first):
    """The law for one tick; u or Q_d is left in the record.

    Args:
        record: (1,) `biped.control.spatial.record.CONTROL`.
        m: `biped.control.spatial.places.Mechanics`.
        first: Whether this is the run's first tick.

    Returns:
        GOING, LOW, TILTED or NOT_FINITE.
    """
    c = record[0]
    status = fallen(c, m)
    if status == NOT_FINITE:
        return status
    sense_places(c, m)
    believe_contacts(c, first)
    leg_states(c, m.q)
    desired_forces(c, m)
    if c["actuation"]["generalized"] == 0:
        point_motion(c, m)
        c["tick"]["limited"] = 1 if pushing_torques(c, m) else 0
    return status
