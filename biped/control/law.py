"""Which law a run has: the thesis's, or a user's own."""

from __future__ import annotations

import numpy as np

from biped.control.controller import Law, ThesisLaw
from biped.robot.run import Run
from biped.robot.tree import Tree


def law_of(run: Run, believed: Tree, q: np.ndarray, v: np.ndarray, log: np.ndarray) -> Law:
    """The control law of a run, bound to its measurements and its log."""
    if run.scenario.law is None and run.law is None:
        return ThesisLaw(run, believed, q, v, log)
    from biped.control.user import UserLaw

    return UserLaw(run, believed, q, v, log)
