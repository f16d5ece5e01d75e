"""One control tick of a biped with a free base: sense, decide the leg states, Q_d, joint torques."""

from biped.base.jit import inner_kernel
from biped.control.smoothing import smooth
from biped.control.space.losses import learn_losses, passive_forces
from biped.control.space.places import believe_contacts, point_motion, sense_places
from biped.control.space.pushing import pushing_torques
from biped.control.space.springs import desired_forces
from biped.control.space.topology import HEEL_END, KNEE, LEGS, TOE_END
from biped.robot.leg_states import leg_state


@inner_kernel
def leg_states(c):
    """Writes the states of both legs into the record: toe or heel is on the ground if any of its two points is."""
    memory, angle, joint = c["memory"], c["at"]["angle"], c["at"]["joint"]
    for leg in range(LEGS):
        toe, heel = memory["believed"][2 * leg + TOE_END], memory["believed"][2 * leg + HEEL_END]
        thigh, other = angle[leg, 0], angle[1 - leg, 0]
        memory["phase"][leg] = leg_state(c["sensing"], toe, heel, thigh, other, thigh, joint[leg, KNEE])


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
    if c["actuation"]["learning"]:
        learn_losses(c, m, first)
    passive_forces(c)
    if c["actuation"]["generalized"] == 0:
        point_motion(c, m)
        c["tick"]["limited"] = pushing_torques(c, m)
        smooth(c["tick"]["u"], c["memory"]["latest"], c["actuation"]["follow"], first)
