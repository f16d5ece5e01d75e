"""One control tick of a biped with a free base: sense, decide the leg states, Q_d, joint torques."""

from __future__ import annotations

from biped.base.jit import inner_kernel
from biped.control.smoothing import smooth
from biped.control.space.phase import leg_states
from biped.control.space.places import believe_contacts, point_motion, sense_places
from biped.control.space.pushing import pushing_torques
from biped.control.space.springs import desired_forces, passive_forces


@inner_kernel
def spatial_tick(record, m, first):
    """The law for one tick; u or Q_d is left in the record.

    Args:
        record: (1,) `biped.control.space.record.CONTROL`.
        m: `biped.control.space.places.Mechanics`.
        first: Whether this is the run's first tick.
    """
    c = record[0]
    sense_places(c, m)
    believe_contacts(c, first)
    leg_states(c)
    desired_forces(c, m)
    passive_forces(c)
    if c["actuation"]["generalized"] == 0:
        point_motion(c, m)
        c["tick"]["limited"] = pushing_torques(c, m)
        smooth(c["tick"]["u"], c["memory"]["latest"], c["actuation"]["follow"], first)
