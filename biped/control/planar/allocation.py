"""Joint torques that move the constrained robot as Q_d would: (3.15), and its general solution (4.7).

With M = RᵀR, C = A R⁻¹ and N = I - C⁺C, the torques minimise ‖N R⁻ᵀ(E u - Q_d)‖, the acceleration energy between the
wanted and the actual motion (3.13), and among those ‖u‖. The factorisation C = P [L 0] Hᵀ gives N = H₂H₂ᵀ for the
columns H₂ of H past the rank, so neither N nor a pseudo-inverse is ever formed: H₂ᵀR⁻ᵀ[E, Q_d] is a small
least-squares problem.

This holds for any M and A that the controller may believe in; with the tree's own, `biped.control.planar.floating`
finds the same torques in a third of the time.
"""

from biped.base.jit import kernel
from biped.control.planar.constraints import believed_mass, imposed_constraints
from biped.numerics.factor import minimum_norm, reflect_block
from biped.numerics.triangular import BLOCK, solve_transposed_block
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
