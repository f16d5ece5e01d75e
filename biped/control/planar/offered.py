"""Results of the thesis's law that a law of one's own may use: rows of A with -J̇v, contacts, and Q_d."""

from __future__ import annotations

from biped.base.jit import kernel
from biped.control.planar.constraints import candidates
from biped.control.planar.springs import desired_forces
from biped.robot.planar.kinematics import point_row
from biped.robot.planar.topology import KNEE, N_POINTS, N_STOPS, NQ, STOP_ROW


@kernel
def offer(record, q, v, J, b_v):
    """Fills the rows of every constraint, touching or not; leaves Q_d and what touches in the record.

    Args:
        record: (1,) `biped.control.planar.record.CONTROL` with sensed links and leg states.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.
        J: (10, 9) overwritten: normal and tangential row of each point, then the knees'.
        b_v: (10,) overwritten: -J̇v.
    """
    c = record[0]
    candidates(c, q)
    desired_forces(c, q, v)
    at = c["at"]
    for i in range(N_POINTS):
        for direction in range(2):
            point_row(at, i, direction, J[2 * i + direction])
            b_v[2 * i + direction] = -at["point_bias"][i, 1 - direction]
    for leg in range(N_STOPS):
        for j in range(NQ):
            J[STOP_ROW + leg, j] = 0.0
        J[STOP_ROW + leg, KNEE[leg]] = 1.0
        b_v[STOP_ROW + leg] = 0.0
