"""Joint torques within limits, the bounded form of (3.13): asked for only in ticks where a limit is exceeded.

With B and d of the reduced problem, min ‖B u - d‖² over |u| <= limit is a quadratic program in a box of six unknowns.
It is solved exactly; other people's solvers can be asked to (`actuation.solver`), which costs a hundred times as much.
"""

import warnings

import numpy as np

from biped.base.errors import InputError
from biped.base.jit import kernel
from biped.control.planar.allocation import reduced_problem
from biped.control.planar.constraints import believed_mass, constraint_rows, factor_constraints
from biped.numerics.box import solve_in_box
from biped.robot.planar.topology import NU

EXACT, FOREIGN = 1, 2
"""Who solves the problem: `biped.numerics.box`, or a package."""

# Breaks ties among minimisers towards u_0, as the closed form does; far below the torques' own scale.
_TIE = 1e-8


@kernel
def _problem(c, M):
    """Fills P (6, 6) and r (6,) of min ½ uᵀP u - rᵀu for this tick's constraints."""
    work, actuation = c["work"], c["actuation"]
    if c["belief"]["perturbed"] == 0:  # otherwise the tick has just factored them
        believed_mass(c, M)
        c["tick"]["rank"] = factor_constraints(c, constraint_rows(c))
    k = reduced_problem(c, c["tick"]["rank"])
    P, r, B, d = work["P"], work["r"], work["B"], work["d"]
    trace = 0.0
    for i in range(NU):
        for j in range(i, NU):
            s = 0.0
            for row in range(k):
                s += B[row, i] * B[row, j]
            P[i, j] = s
            P[j, i] = s
        trace += P[i, i]
    for i in range(NU):
        s = 0.0
        for row in range(k):
            s += B[row, i] * d[row]
        if actuation["use_u_0"]:
            s += _TIE * trace * actuation["u_0"][i]
        r[i] = s
        P[i, i] += _TIE * trace


@kernel
def bounded_torques(c, M):
    """Replaces u by the minimiser of ‖B u - d‖ over |u| <= limit.

    Args:
        c: Controller record after a tick's torques exceeded a limit.
        M: (9, 9) mass matrix, upper triangle.
    """
    work, limit = c["work"], c["actuation"]["limit"]
    _problem(c, M)
    for i in range(NU):
        work["lower"][i] = -limit[i]
    solve_in_box(
        work["P"], work["r"], work["lower"], limit, c["memory"]["side"], c["tick"]["u"], work["root"], work["x"]
    )


@kernel
def problem_of(record, M):
    """The bounded problem of a record (1,) for other solvers, left in its work space."""
    _problem(record[0], M)


def foreign_torques(record: np.ndarray, M: np.ndarray, solver: str) -> np.ndarray:
    """The same minimiser by a solver of `qpsolvers`.

    Args:
        record: Controller record (1,) after a tick's torques exceeded a limit.
        M: (9, 9) mass matrix, upper triangle.
        solver: `daqp`, `quadprog` or `osqp`.

    Returns:
        u (6,) [N m].

    Raises:
        InputError: The solver is not installed.
    """
    from scipy.sparse import csc_matrix

    try:
        import qpsolvers

        there = qpsolvers.available_solvers
    except ImportError:
        there = []
    if solver not in there:
        raise InputError(f"actuation.solver: '{solver}' is not installed; expected active_set, or first: pip install "
                         f"qpsolvers {solver}", "actuation.solver")  # fmt: skip
    problem_of(record, M)
    c = record[0]
    P, r = np.array(c["work"]["P"]), np.array(c["work"]["r"])
    limit, clipped = np.array(c["actuation"]["limit"]), np.array(c["tick"]["u"])
    settings = {}
    if solver == "osqp":
        P = csc_matrix(np.triu(P))
        settings = {"initvals": clipped, "eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 20000, "polishing": True}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        u = qpsolvers.solve_qp(P, -r, lb=-limit, ub=limit, solver=solver, **settings)
    if u is None:  # the clipped closed form is feasible, merely not optimal
        return clipped
    return np.clip(u, -limit, limit)
