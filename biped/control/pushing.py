"""Joint torques for ground that only pushes: the principle of least acceleration energy with unilateral contacts.

(3.15) takes every row of A for bilateral. Here every contact point has the edges n ± μt of its friction cone and every
knee its stop, as inequalities, and two strictly convex problems follow one another each tick (docs/pushing.md):

1. the motion that Q_d itself would cause on such ground, Gauss's principle with inequalities:
   q̈_d = argmin ½‖q̈ - M⁻¹(Q_d - h)‖²_M subject to G q̈ >= b - gap, with forces c_d >= 0 and slack >= 0;
2. the torques nearest to it, with ground forces c >= 0 as unknowns:
   min ½‖R⁻ᵀ(E u + Gᵀc - (M q̈_d + h))‖² + ½ ε‖u‖² + ½ Σ ρ_k [(height_k/η)² + (slack_k/σ)²] c_k², |u| <= limit.

A point enters the first by coming near, gap = max(0, 2 v_n/τ + height/τ²), and fades out of the second with its height
and with the acceleration at which q̈_d lifts it; ρ_k is the inverse mass that c_k finds in a biped with rigid joints,
and ε for a stop, which does the same as its joint's torque. With c free, touching points
at rest and ε → 0 the second problem is (3.15).

Eliminating u from the second by P = (M + EEᵀ/ε)⁻¹ leaves one in c alone, of the same kind as the dual of the first:
ten non-negative unknowns, solved exactly. A torque at its limit leaves E, and is a known force.
"""

from __future__ import annotations

import math

from biped.base.jit import kernel
from biped.control.constraints import believed_mass, perturb_row
from biped.numerics.nonnegative import nonnegative
from biped.numerics.triangular import cholesky, solve_transposed, solve_upper, weigh_rows
from biped.robot.kinematics import bias_forces, biases_on_links, point_row
from biped.robot.topology import BASE, FOOT, KNEE, N_POINTS, N_ROWS, N_STOPS, NQ, NU, STOP_ROW

_TIE = 1e-12
"""Raises the diagonals by this fraction: where forces share a load in many ways, the shortest share is taken."""
_MOST_CHANGES = 30
_SLACK_OF_LIMIT = 1e-9
"""[N m] by which a torque may pass its limit before it is held there."""


@kernel
def unilateral_rows(c, q, v):
    """Builds the edges G (10, 9), the least accelerations b - gap along them, and how far each is from pushing [m].

    Rows 2i and 2i + 1 are the edges of point i, the last two the knees' stops (angles times the shank's length).
    """
    at, push, tick, work, belief = c["at"], c["push"], c["tick"], c["work"], c["belief"]
    G, least, away = push["G"], push["least"], push["away"]
    n, t = work["a"], work["z"]
    tau = push["approach"]
    for i in range(N_POINTS):
        point_row(at, i, 0, n)
        point_row(at, i, 1, t[:NQ])
        if belief["perturbed"]:
            perturb_row(c, n, belief["row_factor"][2 * i])
            perturb_row(c, t[:NQ], belief["row_factor"][2 * i + 1])
        speed = 0.0
        for j in range(NQ):
            speed += n[j] * v[j]
        gap = max(0.0, 2.0 * speed / tau + tick["height"][i] / (tau * tau))
        for side in range(2):
            mu = push["friction"] if side == 0 else -push["friction"]
            k = 2 * i + side
            for j in range(NQ):
                G[k, j] = n[j] + mu * t[j]
            least[k] = -at["point_bias"][i, 1] - mu * at["point_bias"][i, 0] - gap
            away[k] = max(0.0, tick["height"][i])
    for leg in range(N_STOPS):
        k = STOP_ROW + leg
        knee = KNEE[leg]
        for j in range(NQ):
            G[k, j] = 0.0
        G[k, knee] = -1.0
        if belief["perturbed"]:
            perturb_row(c, G[k], belief["row_factor"][k])
        least[k] = -max(0.0, -2.0 * v[knee] / tau - q[knee] / (tau * tau))
        away[k] = _shank(c, leg) * max(0.0, -q[knee])


@kernel
def _shank(c, leg):
    """Length [m] from knee to ankle."""
    x, z = c["tree"]["joint"][FOOT[leg], 0], c["tree"]["joint"][FOOT[leg], 1]
    return math.sqrt(x * x + z * z)


@kernel
def _gram(C, H):
    """Fills the lower triangle of H = C Cᵀ (10, 10), and breaks its ties."""
    top = 0.0
    for i in range(N_ROWS):
        for k in range(i + 1):
            s = 0.0
            for j in range(NQ):
                s += C[i, j] * C[k, j]
            H[i, k] = s
        top = max(top, H[i, i])
    for i in range(N_ROWS):
        H[i, i] += _TIE * top


@kernel
def wanted_motion(c):
    """The first problem: leaves its ground forces c_d in `wanted_force`, what is left over in `slack`."""
    push, tick, work = c["push"], c["tick"], c["work"]
    x, C, f = work["a"], work["C"], push["f"]
    for j in range(NQ):
        x[j] = tick["Q_d"][j] - tick["h"][j]
    solve_transposed(work["R"], x)
    weigh_rows(push["G"], work["R"], N_ROWS, C)
    _gram(C, push["H"])
    for i in range(N_ROWS):
        s = push["least"][i]
        for j in range(NQ):
            s -= C[i, j] * x[j]
        f[i] = s
    for i in range(N_ROWS):
        rho = 0.0 if i < STOP_ROW else push["regularisation"]
        for j in range(BASE):
            rho += C[i, j] * C[i, j]
        push["rho"][i] = rho
    push["changes"][0] = nonnegative(push["H"], f, N_ROWS, push["held"], work["L"], push["wanted_force"], push["slack"])


@kernel
def _free_mass(c, M):
    """Fills work M with M + EEᵀ/ε, E being the torques that are not at their limits, and its factor in push R."""
    push, work, belief = c["push"], c["work"], c["belief"]
    full = work["M"]
    if belief["perturbed"] == 0:  # otherwise `believed_mass` has left the wrong M there, to which only 1/ε is added
        for i in range(NQ):
            for j in range(i, NQ):
                full[i, j] = M[i, j]
    for j in range(NU):
        if push["side"][j] == 0:
            full[BASE + j, BASE + j] += 1.0 / push["regularisation"]
    cholesky(full, push["R"])
    for j in range(NU):  # M may be this very array
        if push["side"][j] == 0:
            full[BASE + j, BASE + j] -= 1.0 / push["regularisation"]


@kernel
def _nearest_forces(c):
    """The second problem in c: leaves the ground forces in `force` and P (M q̈_d + h - Gᵀc) in work a."""
    push, tick, work = c["push"], c["tick"], c["work"]
    G, C, H, f, x = push["G"], work["C"], push["H"], push["f"], work["a"]
    weigh_rows(G, push["R"], N_ROWS, C)
    _gram(C, H)
    for i in range(N_ROWS):
        slack = push["slack"][i]
        if i >= STOP_ROW:
            slack *= _shank(c, i - STOP_ROW)
        away, slack = push["away"][i] / push["reach"], slack / push["yielding"]
        H[i, i] += push["rho"][i] * (away * away + slack * slack)
    target = work["d"]  # M q̈_d + h = Q_d + Gᵀc_d, less the torques at their limits
    for j in range(NQ):
        s = tick["Q_d"][j]
        for i in range(N_ROWS):
            s += G[i, j] * push["wanted_force"][i]
        if j >= BASE:
            s -= push["side"][j - BASE] * c["actuation"]["limit"][j - BASE]
        target[j] = s
        x[j] = s
    solve_transposed(push["R"], x)
    for i in range(N_ROWS):
        s = 0.0
        for j in range(NQ):
            s += C[i, j] * x[j]
        f[i] = s
    push["changes"][1] = nonnegative(H, f, N_ROWS, push["pressed"], work["L"], push["force"], work["force"])
    for j in range(NQ):
        s = target[j]
        for i in range(N_ROWS):
            s -= G[i, j] * push["force"][i]
        x[j] = s
    solve_transposed(push["R"], x)
    solve_upper(push["R"], x)


@kernel
def _change_limits(c):
    """Writes the torques and moves the worst offender to or from its limit; returns whether there was one."""
    push, u, limit, x = c["push"], c["tick"]["u"], c["actuation"]["limit"], c["work"]["a"]
    worst, which, side = _SLACK_OF_LIMIT, -1, 0
    for j in range(NU):
        wanted = x[BASE + j] / push["regularisation"]
        if push["side"][j] == 0:
            u[j] = wanted
            beyond, to = abs(wanted) - limit[j], (1 if wanted > 0.0 else -1)
        else:
            u[j] = push["side"][j] * limit[j]
            beyond, to = limit[j] - push["side"][j] * wanted, 0
        if beyond > worst:
            worst, which, side = beyond, j, to
    if which >= 0:
        push["side"][which] = side
    return which >= 0


@kernel
def pushing_torques(c, M, q, v):
    """Writes the joint torques u (6,) [N m] for the record's Q_d; returns whether one of them is at its limit.

    Args:
        c: Controller record with sensed links and Q_d.
        M: (9, 9) mass matrix, upper triangle.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.
    """
    at, push, tick = c["at"], c["push"], c["tick"]
    biases_on_links(c["tree"], at)
    bias_forces(c["tree"], at, c["belief"]["gravity"], tick["h"])
    believed_mass(c, M)
    unilateral_rows(c, q, v)
    wanted_motion(c)
    for _ in range(_MOST_CHANGES):
        _free_mass(c, M)
        _nearest_forces(c)
        if not _change_limits(c):
            break
    limited = False
    for j in range(NU):
        limit = c["actuation"]["limit"][j]
        limited = limited or push["side"][j] != 0
        tick["u"][j] = min(max(tick["u"][j], -limit), limit)
    for i in range(N_POINTS):
        tick["active"][i] = 1 if push["force"][2 * i] + push["force"][2 * i + 1] > 0.0 else 0
    for leg in range(N_STOPS):
        tick["active"][N_POINTS + leg] = 1 if push["force"][STOP_ROW + leg] > 0.0 else 0
    return limited
