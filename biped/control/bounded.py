"""Joint torques within limits, the bounded form of (3.13): asked for only in ticks where a limit is exceeded."""

from __future__ import annotations

import warnings

import numpy as np

from biped.control.allocation import reduced_problem
from biped.robot.topology import NU

# Breaks ties among minimisers towards u_0, as the closed form does; far below the torques' own scale.
_TIE = 1e-8


def bounded_torques(c) -> np.ndarray:
    """Minimises ‖B u - d‖ over |u| <= limit for the tick whose constraints are factored in the record.

    Args:
        c: Controller record after `joint_torques` exceeded a limit.

    Returns:
        u (6,) [N m].
    """
    import qpsolvers
    from scipy.sparse import csc_matrix

    k = reduced_problem(c, int(c["tick"]["rank"]))
    B, d = c["work"]["B"][:k].copy(), c["work"]["d"][:k].copy()
    u_0 = c["actuation"]["u_0"] if c["actuation"]["use_u_0"] else np.zeros(NU)
    gram = B.T @ B
    tie = _TIE * np.trace(gram)
    P = csc_matrix(np.triu(gram + tie * np.eye(6)))
    limit = np.array(c["actuation"]["limit"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        u = qpsolvers.solve_qp(
            P, -(B.T @ d) - tie * u_0, lb=-limit, ub=limit, solver="osqp", initvals=np.array(c["tick"]["u"]),
            eps_abs=1e-9, eps_rel=1e-9, max_iter=20000, polishing=True,
        )  # fmt: skip
    if u is None:  # the clipped closed form is feasible, merely not optimal
        return np.array(c["tick"]["u"])
    return np.clip(u, -limit, limit)
