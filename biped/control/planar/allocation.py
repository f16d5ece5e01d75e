"""Joint torques that move the constrained robot as Q_d would: (3.15), its general solution (4.7), and within limits.

With M = RᵀR, C = A R⁻¹ and N = I - C⁺C, the torques minimise ‖N R⁻ᵀ(E u - Q_d)‖, the acceleration energy between the
wanted and the actual motion (3.13), and among those ‖u‖. The factorisation C = P [L 0] Hᵀ gives N = H₂H₂ᵀ for the
columns H₂ of H past the rank, so neither N nor a pseudo-inverse is ever formed: H₂ᵀR⁻ᵀ[E, Q_d] is a small
least-squares problem.

This holds for any M and A that the controller may believe in; with the tree's own, `biped.control.planar.floating`
finds the same torques in a third of the time.

With B and d of the reduced problem, min ‖B u - d‖² over |u| <= limit is a quadratic program in a box of six unknowns.
It is solved exactly; other people's solvers can be asked to (`actuation.solver`), which costs a hundred times as much.
"""

import warnings

import numpy as np

from biped.base.errors import InputError
from biped.base.jit import kernel
from biped.control.planar.constraints import believed_mass, constraint_rows, factor_constraints, imposed_constraints
from biped.numerics.factor import BLOCK, minimum_norm, reflect_block, solve_transposed_block
from biped.numerics.quadratic import MOST_STEPS, solve_in_box
from biped.robot.planar.topology import BASE, NQ, NU


@kernel
def reduced_problem(c, rank):
    """Fills B (k, 6) and d (k,) of min ‖B u - d‖, the reduced (3.14), k = 9 - rank; returns k."""
    work = c["work"]
    X, B, d = work["X"], work["B"], work["d"]
    for i in range(NQ):
        for j in range(BLOCK):
            X[i, j] = 0.0
        X[i, NU] = c["tick"]["Q_d"][i]
    for i in range(NU):
        X[BASE + i, i] = 1.0
    solve_transposed_block(work["R"], X)
    reflect_block(work["C"], rank, work["tau"], X, work["line"])
    for i in range(rank, NQ):
        for j in range(NU):
            B[i - rank, j] = X[i, j]
        d[i - rank] = X[i, NU]
    return NQ - rank


@kernel
def minimum_norm_torques(c, k):
    """Solves the reduced problem: u = B⁺d + (I - B⁺B) u_0, by min ‖u - u_0‖ among the minimisers of ‖B u - d‖."""
    work, actuation = c["work"], c["actuation"]
    B, d, u = work["B"], work["d"], c["tick"]["u"]
    if actuation["use_u_0"]:
        for i in range(k):
            for j in range(NU):
                d[i] -= B[i, j] * actuation["u_0"][j]
    minimum_norm(
        B, k, NU, actuation["tolerance"], work["tau_B"], work["pivot_B"], work["L"], work["tau2"], d, work["z"], u
    )
    if actuation["use_u_0"]:
        for j in range(NU):
            u[j] += actuation["u_0"][j]


@kernel
def clip_torques(c):
    """Clips u to the torque limits; returns whether any was exceeded."""
    u, limit = c["tick"]["u"], c["actuation"]["limit"]
    over = False
    for j in range(NU):
        if u[j] > limit[j]:
            u[j] = limit[j]
            over = True
        elif u[j] < -limit[j]:
            u[j] = -limit[j]
            over = True
    return over


@kernel
def joint_torques(c, M, q):
    """Writes the joint torques u (6,) [N m] for the record's Q_d, whatever the model errors.

    Args:
        c: Controller record with sensed links and Q_d.
        M: (9, 9) mass matrix, upper triangle.
        q: (9,) joint coordinates.

    Returns:
        Whether a torque limit was exceeded.
    """
    tick = c["tick"]
    believed_mass(c, M)
    m, rank = imposed_constraints(c, q)
    tick["rows"] = m
    tick["rank"] = rank
    minimum_norm_torques(c, reduced_problem(c, rank))
    return clip_torques(c)


EXACT, FOREIGN = 1, 2
"""Who solves the problem: `biped.numerics.quadratic`, or a package."""

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
    steps = solve_in_box(
        work["P"], work["r"], work["lower"], limit, c["memory"]["side"], c["tick"]["u"], work["root"], work["x"]
    )
    if steps == MOST_STEPS:
        c["tick"]["given_up"] = 1


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
        c["memory"]["given_up"] += 1
        return clipped
    return np.clip(u, -limit, limit)
