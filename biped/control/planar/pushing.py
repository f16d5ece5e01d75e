"""Joint torques for ground that only pushes: the principle of least acceleration energy with unilateral contacts.

(3.15) takes every row of A for bilateral. Here every contact point has the edges n ± μt of its friction cone and every
knee its stop, as inequalities, and two strictly convex problems follow one another each tick (docs/pushing.md):

1. the motion that Q_d itself would cause on such ground, Gauss's principle with inequalities:
   q̈_d = argmin ½‖q̈ - M⁻¹(Q_d - h)‖²_M subject to G q̈ >= b - gap, with forces c_d >= 0 and slack >= 0;
2. the torques nearest to it, with ground forces c >= 0 as unknowns:
   min ½‖R⁻ᵀ(E u + Gᵀc - (M q̈_d + h))‖² + ½ ε‖u‖² + ½ Σ ρ_k [(height_k/η)² + (slack_k/σ)²] c_k², |u| <= limit.

A point enters the first by coming near, gap = max(0, 2 v_n/τ + height/τ²), or a share of what is below 0 as the
deceleration of a soft landing (`biped.control.blending.downward`), and fades out of the second with its height and
with the acceleration at which q̈_d lifts it; ρ_k is the inverse mass that c_k finds in a biped with rigid joints,
and ε for a stop, which does the same as its joint's torque. With c free, touching points
at rest and ε → 0 the second problem is (3.15).

Eliminating u from the second by P = (M + EEᵀ/ε)⁻¹ leaves one in c alone, of the same kind as the dual of the first:
ten non-negative unknowns, solved exactly. A torque at its limit leaves E, and is a known force. Edges and stops stand
in lanes, and in lane `Q_LANE` the forces that both problems weigh.
"""

from biped.base.jit import kernel
from biped.control.blending import downward
from biped.control.limits import MOST_CHANGES, change_limits
from biped.control.planar.constraints import believed_bias, perturb_row, perturbed_mass
from biped.numerics.lanes import added, everywhere, load, plus, squared, store, times, total
from biped.numerics.quadratic import MOST, nonnegative
from biped.robot.planar.kinematics import point_row
from biped.robot.planar.topology import (
    BASE,
    HIP,
    KNEE,
    N_POINTS,
    N_ROWS,
    N_STOPS,
    NQ,
    NU,
    POINT_LEG,
    SEGMENTS,
    STOP_ROW,
    TOE,
)  # fmt: skip
from biped.robot.planar.weighing import factor_from_feet, factor_torso, substitute_from_feet, weigh, weigh_torso

Q_LANE = N_ROWS
_LEG = (*(POINT_LEG[row // 2] for row in range(STOP_ROW)), *range(N_STOPS))
"""Whose leg's a row is: those of the other are not in it."""
_TIE = 1e-12
"""Raises the diagonals by this fraction: where forces share a load in many ways, the shortest share is taken."""


@kernel
def unilateral_rows(c, q, v):
    """Builds the edges G by lane, the least accelerations b - gap along them, and how far each is from pushing [m].

    Lanes 2i and 2i + 1 are the edges of point i, then the knees' stops (angles times the shank's length).
    """
    at, push, tick, work = c["at"], c["push"], c["tick"], c["work"]
    least, away, scale, speed = push["least"], push["away"], push["scale"], push["speed"]
    tau, friction = push["approach"], push["friction"]
    cone_edges(c, at, v, friction, c["belief"]["perturbed"], work["a"], work["z"][:NQ], c["rows"]["A"], speed)
    for i in range(N_POINTS):
        gap = downward(speed[i], tick["height"][i], tau, push["braking"])
        for side in range(2):
            mu = friction if side == 0 else -friction
            least[0, 2 * i + side] = -at["point_bias"][i, 1] - mu * at["point_bias"][i, 0] - gap
            away[0, 2 * i + side] = max(0.0, tick["height"][i])
    for leg in range(N_STOPS):
        k, knee = STOP_ROW + leg, KNEE[leg]
        least[0, k] = -max(0.0, -2.0 * v[knee] / tau - q[knee] / (tau * tau))
        away[0, k] = scale[0, k] * max(0.0, -q[knee])


@kernel
def cone_edges(c, at, v, friction, wrong, n, t, G, speed):
    """Builds the edges of the friction cones and the knees' stops by lane, as the law believes in them.

    Args:
        c: Controller record.
        at: `PLACES` record of the configuration.
        v: (9,) joint velocities.
        friction: Coefficient of friction.
        wrong: Whether the rows have the errors of A that the law believes in.
        n: (9,) work space.
        t: (9,) work space.
        G: (9, lanes) result.
        speed: (4,) result: speed [m/s] with which each point rises.
    """
    belief = c["belief"]
    for j in range(NQ):
        store(G, j, everywhere(0.0))
    for i in range(N_POINTS):
        point_row(at, i, 0, n)
        point_row(at, i, 1, t)
        if wrong:
            # Two rows that say the same of a flat foot, each wrong in its own way, would say that shear between toe and
            # heel turns the leg: a foot that is asked once cannot contradict itself.
            whose = i + 1 if c["actuation"]["single_tangential"] and i in TOE else i
            perturb_row(c, n, belief["row_factor"][2 * i])
            perturb_row(c, t, belief["row_factor"][2 * whose + 1])
        rising = 0.0
        for j in range(NQ):
            rising += n[j] * v[j]
            G[j, 2 * i] = n[j] + friction * t[j]
            G[j, 2 * i + 1] = n[j] - friction * t[j]
        speed[i] = rising
    for leg in range(N_STOPS):
        k = STOP_ROW + leg
        G[KNEE[leg], k] = -1.0
        if wrong:
            perturb_row(c, G[:, k], belief["row_factor"][k])


@kernel
def gram(C, H):
    """Fills the rows of H = CᵀC (10, lanes) and breaks its ties; lane Q_LANE is what the forces there do along them."""
    top = 0.0
    for k in range(N_ROWS):
        hip = HIP[_LEG[k]]
        a = b = everywhere(0.0)
        for j in range(BASE):
            a = added(a, C[j, k], load(C, j))
        for j in range(hip, hip + SEGMENTS):
            b = added(b, C[j, k], load(C, j))
        store(H, k, plus(a, b))
        top = max(top, H[k, k])
    for k in range(N_ROWS):
        H[k, k] += _TIE * top


@kernel
def wanted_motion(c):
    """The first problem: leaves its ground forces c_d in `wanted_force`, what is left over in `slack`."""
    push, tick, rows = c["push"], c["tick"], c["rows"]
    A, H, f = rows["A"], push["H"], push["f"]
    for j in range(NQ):
        A[j, Q_LANE] = tick["Q_d"][j] - tick["h"][j]
    for j in range(NU):
        rows["spring"][j] = 0.0
    factor_from_feet(c["work"]["M"], rows["spring"], rows["L"])
    weigh(A, rows["L"], rows["C"])
    gram(rows["C"], H)
    for k in range(N_ROWS):
        f[0, k] = push["least"][0, k] - H[k, Q_LANE]
    push["changes"][0] = nonnegative(
        H, f, N_ROWS, push["held"], push["order"], push["U"], c["work"]["L"], push["wanted_force"], push["slack"]
    )


@kernel
def _prices(c):
    """Fills by lane what a force's square costs where its point is above the ground or is lifted."""
    push, rows = c["push"], c["rows"]
    D, rho, scale = rows["D"], push["rho"], load(push["scale"], 0)
    factor_torso(c["work"]["M"], rows["S"])
    for j in range(BASE):
        store(D, j, load(rows["A"], j))
    weigh_torso(rows["S"], D)
    store(rho, 0, squared(squared(times(load(D, 0), load(D, 0)), load(D, 1)), load(D, 2)))
    for k in range(STOP_ROW, N_ROWS):
        rho[0, k] = push["regularisation"]
    away = times(everywhere(1.0 / push["reach"]), load(push["away"], 0))
    slack = times(everywhere(1.0 / push["yielding"]), times(scale, load(push["slack"], 0)))
    store(push["price"], 0, times(load(rho, 0), squared(times(away, away), slack)))


@kernel
def _forces_wanted(c):
    """Writes M q̈_d + h = Q_d + Gᵀc_d, less the torques at their limits, into lane Q_LANE of G; 1/ε of the others."""
    push, tick, rows = c["push"], c["tick"], c["rows"]
    A, c_d = rows["A"], load(push["wanted_force"], 0)
    for j in range(NQ):
        A[j, Q_LANE] = tick["Q_d"][j] + total(times(c_d, load(A, j)))
    for j in range(NU):
        rows["spring"][j] = 1.0 / push["regularisation"] if push["side"][j] == 0 else 0.0
        A[BASE + j, Q_LANE] -= push["side"][j] * c["actuation"]["limit"][j]


@kernel
def _nearest_forces(c):
    """The second problem in c: leaves the ground forces in `force` and P (M q̈_d + h - Gᵀc) in work a."""
    push, rows, x = c["push"], c["rows"], c["work"]["a"]
    C, L, H, f, force = rows["C"], rows["L"], push["H"], push["f"], push["force"]
    factor_from_feet(c["work"]["M"], rows["spring"], L)
    weigh(rows["A"], L, C)
    gram(C, H)
    for k in range(N_ROWS):
        H[k, k] += push["price"][0, k]
        f[0, k] = H[k, Q_LANE]
    push["changes"][1] = nonnegative(
        H, f, push["counted"], push["pressed"], push["order"], push["U"], c["work"]["L"], force, rows["kept"]
    )
    left = times(everywhere(-1.0), load(force, 0))
    for j in range(NQ):
        x[j] = C[j, Q_LANE] + total(times(left, load(C, j)))
    substitute_from_feet(L, x)


@kernel
def pushing_torques(c, M, q, v):
    """Writes the joint torques u (6,) [N m] for the record's Q_d; returns whether one of them is at its limit.

    Args:
        c: Controller record with sensed links and Q_d.
        M: (9, 9) mass matrix, upper triangle.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.
    """
    push, tick, work, belief = c["push"], c["tick"], c["work"], c["belief"]
    believed_bias(c)
    if belief["perturbed"]:
        perturbed_mass(M, belief["mass_factor"], work["M"])
    else:
        for i in range(NQ):  # M may be this very array
            for j in range(i, NQ):
                work["M"][i, j] = M[i, j]
    unilateral_rows(c, q, v)
    wanted_motion(c)
    _prices(c)
    solved = push["changes"][0] < MOST
    limits, weight = c["actuation"]["limit"], push["regularisation"]
    for turn in range(MOST_CHANGES):
        _forces_wanted(c)
        _nearest_forces(c)
        solved = solved and push["changes"][1] < MOST
        if not change_limits(turn, work["a"], 0, BASE, weight, limits, push["side"], tick["u"]):
            break
    else:
        solved = False
    if not solved:
        tick["given_up"] = 1
    limited = False
    for j in range(NU):
        limited = limited or push["side"][j] != 0
        tick["u"][j] = min(max(tick["u"][j], -limits[j]), limits[j])
    force = push["force"]
    for i in range(N_POINTS):
        tick["active"][i] = 1 if force[0, 2 * i] + force[0, 2 * i + 1] > 0.0 else 0
    for leg in range(N_STOPS):
        tick["active"][N_POINTS + leg] = 1 if force[0, STOP_ROW + leg] > 0.0 else 0
    return limited
