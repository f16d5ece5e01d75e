"""The ground forces that a law for ground that only pushes counts on, found again from what a run logged."""

import numpy as np

from biped.base.jit import kernel
from biped.control.planar.errors import redraw
from biped.control.planar.prediction import predicts
from biped.control.planar.pushing import pushing_torques
from biped.control.planar.sensing import sense_links
from biped.control.planar.setup import controller_record
from biped.measure.trajectory import Trajectory
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.planar.topology import N_POINTS, NQ
from biped.robot.run import Run
from biped.scenario.keys import Sensors


def believed_forces(run: Run, t: Trajectory) -> np.ndarray | None:
    """The forces c of the second problem (`biped.control.planar.pushing`) that the torques of each tick belong to.

    They follow from a tick's coordinates and Q_d, both logged.

    Args:
        run: The run.
        t: What it left behind.

    Returns:
        (n, 4, 2) [N] on toes and heels, along and normal to the ground; None where the law counts on no forces, or
        measured coordinates that the log does not have.
    """
    s = run.scenario
    counted = s.actuation.contacts == "pushing" and s.actuation.mode == "joint" and s.law is None and run.law is None
    if "Q_d" not in t.columns or not counted or predicts(s) or s.estimator is not None or s.sensors != Sensors():
        return None
    out = np.zeros((len(t), N_POINTS, 2))
    _forces(controller_record(run, run.tree), *(np.array(a) for a in (t.q, t.v, t.Q_d)), out)
    return out


@kernel
def _forces(record, q, v, Q_d, out):
    c = record[0]
    push = c["push"]
    for k in range(len(q)):
        sense_links(c, q[k], v[k])
        for j in range(NQ):
            c["tick"]["Q_d"][j] = Q_d[k, j]
        mass_matrix(c["tree"], c["at"], c["work"]["M"])
        if c["belief"]["redrawn"]:
            redraw(c["belief"])
        pushing_torques(c, c["work"]["M"], q[k], v[k])
        for i in range(N_POINTS):
            ahead, behind = push["force"][0, 2 * i], push["force"][0, 2 * i + 1]
            out[k, i, 0] = push["friction"] * (ahead - behind)
            out[k, i, 1] = ahead + behind
