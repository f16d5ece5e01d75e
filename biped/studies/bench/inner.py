"""Parts of a control tick in compiled loops of their own, for the bench alone."""

import numpy as np

from biped.base.address import call
from biped.base.jit import long_kernel
from biped.control.planar.floating import floating_torques
from biped.control.planar.sensing import sense_links
from biped.control.planar.setup import controller_record
from biped.control.planar.tick import thesis_tick
from biped.measure.trajectory import Trajectory
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.run import Run


@long_kernel
def steps(step, model, data, taken, given, substeps):
    """Bare steps under given forces (n, 6 or 9), each for `substeps`; addresses as in `biped.engines.planar.walk`."""
    for k in range(given.shape[0]):
        for j in range(taken.size):
            taken[j] = given[k, j]
        for _ in range(substeps):
            call(step, model, data)


@long_kernel
def _trees(record, q, v, Q_d, torques):
    c = record[0]
    M = c["work"]["M"]
    for k in range(q.shape[0]):
        sense_links(c, q[k], v[k])
        mass_matrix(c["tree"], c["at"], M)
        if torques:
            for j in range(Q_d.shape[1]):
                c["tick"]["Q_d"][j] = Q_d[k, j]
            floating_torques(c, M, q[k])


@long_kernel
def _laws(record, q, v, log):
    for k in range(q.shape[0]):
        thesis_tick(record, q[k], v[k], log, k, 0.0)


class Inner:
    """The parts of a tick over all states of a run.

    Args:
        run: The run.
        trajectory: What it left behind.
    """

    def __init__(self, run: Run, trajectory: Trajectory):
        self._record = controller_record(run, run.tree)
        columns = (trajectory.q, trajectory.v, trajectory.Q_d)
        self._q, self._v, self._Q_d = (np.ascontiguousarray(column) for column in columns)
        self._log = np.array(trajectory.log)

    def tree(self) -> None:
        """Kinematics and mass matrix."""
        _trees(self._record, self._q, self._v, self._Q_d, False)

    def tree_and_torques(self) -> None:
        """These and the joint torques."""
        _trees(self._record, self._q, self._v, self._Q_d, True)

    def law(self) -> None:
        """The whole tick of the controller."""
        _laws(self._record, self._q, self._v, self._log)
