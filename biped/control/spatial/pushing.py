"""Joint torques for ground that only pushes (`biped.control.pushing`), with free base, twelve torques and eight points.

The two problems and their prices are those of the plane; an edge is one of four, n ± μ x and n ± μ y, of the pyramid
within a point's friction cone. Points so high that neither problem can want them are left out.
"""

from __future__ import annotations

from biped.base.jit import kernel
from biped.control.spatial.record import EDGES, LEG_EDGES, N_EDGES
from biped.control.spatial.reduced import (
    EXTRA,
    FORCE_LANE,
    STOP_LANE,
    factor,
    lay_forces,
    lay_stops,
    motion,
    products,
    weigh,
)
from biped.control.spatial.topology import BASE, KNEE, LEG, LEG_POINTS, LEGS, N, N_POINTS, NU
from biped.numerics.lanes import LANES
from biped.numerics.nonnegative import nonnegative

_TIE = 1e-7
"""Raises the diagonals by this fraction: sixteen forces share what six could do, and the shortest share is taken."""
_FAR = 300.0
"""[m/s²] A point whose gap asks for more upward motion than this is left alone."""
_SHANK = 0.4428
"""[m] by which a stop's angle counts as a distance."""
_MOST_CHANGES = 30
_SLACK_OF_LIMIT = 1e-9


@kernel
def unilateral_rows(c, m):
    """Fills the least accelerations along the edges, how far points are from pushing, and which points count."""
    at, work, act = c["at"], c["work"], c["actuation"]
    tau, mu = act["approach"], act["friction"]
    n = 0
    for p in range(N_POINTS):
        gap = max(0.0, 2.0 * at["speed"][p] / tau + at["height"][p] / (tau * tau))
        work["near"][p] = 1 if gap < _FAR else 0
        if work["near"][p] == 0:
            for e in range(EDGES):
                c["memory"]["held"][EDGES * p + e] = 0
                c["memory"]["pressed"][EDGES * p + e] = 0
            continue
        bias = at["bias"][p]
        for e in range(EDGES):
            k = EDGES * p + e
            slip = mu * bias[1 + e // 2]
            work["least"][k] = -bias[0] - (slip if e % 2 == 0 else -slip) - gap
            work["away"][k] = max(0.0, at["height"][p])
            work["kept"][n] = k
            n += 1
    for leg in range(LEGS):
        k = N_EDGES + leg
        q, v = m.q[BASE + 1 + LEG * leg + KNEE], m.v[BASE + LEG * leg + KNEE]
        work["least"][k] = -max(0.0, -2.0 * v / tau - q / (tau * tau))
        work["away"][k] = _SHANK * max(0.0, -q)
        work["kept"][n] = k
        n += 1
    return n


@kernel
def _edge_product(D, mu, a, b):
    """What a force along unknown a does along unknown b: two products of directions each."""
    s = 0.0
    if a < N_EDGES:
        up = LANES * (a // LEG_EDGES) + 3 * (a % LEG_EDGES // EDGES)
        side = up + 1 + a % EDGES // 2
        slope = mu if a % 2 == 0 else -mu
    else:
        up = EXTRA + a - N_EDGES
        side = up
        slope = 0.0
    if b < N_EDGES:
        up_b = LANES * (b // LEG_EDGES) + 3 * (b % LEG_EDGES // EDGES)
        side_b = up_b + 1 + b % EDGES // 2
        slope_b = mu if b % 2 == 0 else -mu
        s = D[up, up_b] + slope_b * D[up, side_b]
        if slope != 0.0:
            s += slope * (D[side, up_b] + slope_b * D[side, side_b])
    else:
        lane = STOP_LANE[b - N_EDGES]
        s = D[up, lane]
        if slope != 0.0:
            s += slope * D[side, lane]
    return s


@kernel
def _along(D, mu, a):
    """What the forces in their lanes do along unknown a."""
    if a >= N_EDGES:
        row = EXTRA + a - N_EDGES
        return D[row, FORCE_LANE[0]] + D[row, FORCE_LANE[1]]
    up = LANES * (a // LEG_EDGES) + 3 * (a % LEG_EDGES // EDGES)
    side = up + 1 + a % EDGES // 2
    slope = mu if a % 2 == 0 else -mu
    return D[up, FORCE_LANE[0]] + D[up, FORCE_LANE[1]] + slope * (D[side, FORCE_LANE[0]] + D[side, FORCE_LANE[1]])


@kernel
def _reduce(c, n, soft, forces):
    """Fills H (n, n) of the unknowns that count and breaks its ties; f holds what the forces do along them."""
    work, mu = c["work"], c["actuation"]["friction"]
    H, f, kept, D = work["H"], work["f"], work["kept"], work["D"]
    near = (False, False)
    for p in range(LEG_POINTS):
        near = (near[0] or work["near"][p] != 0, near[1] or work["near"][LEG_POINTS + p] != 0)
    lay_forces(c, forces)
    factor(c, soft)
    weigh(c, near)
    products(c, near)
    top = 0.0
    for i in range(n):
        for j in range(i + 1):
            s = _edge_product(D, mu, kept[i], kept[j])
            H[i, j] = s
            H[j, i] = s
        top = max(top, H[i, i])
        f[0, i] = _along(D, mu, kept[i])
    for i in range(n):
        H[i, i] += _TIE * top


@kernel
def _solve(c, n, remembered, force):
    """Solves the problem in its unknowns; leaves forces by edge, and multipliers in work y."""
    work = c["work"]
    kept, free = work["kept"], work["free"]
    for i in range(n):
        free[i] = remembered[kept[i]]
    changes = nonnegative(work["H"], work["f"], n, free, work["order"], work["L"], work["x"], work["y"])
    for k in range(force.size):
        force[k] = 0.0
    for i in range(n):
        remembered[kept[i]] = free[i]
        force[kept[i]] = work["x"][0, i]
    return changes


@kernel
def wanted_motion(c, m, n):
    """The first problem: leaves its ground forces in `wanted_force`, what is left over in `slack`."""
    work, tick = c["work"], c["tick"]
    for j in range(N):
        work["z"][j] = tick["Q_d"][j] - m.h[j]
    for j in range(NU):
        work["soft"][j] = 0.0
    _reduce(c, n, work["soft"], work["z"])
    for i in range(n):
        work["f"][0, i] = work["least"][work["kept"][i]] - work["f"][0, i]
    tick["changes"][0] = _solve(c, n, c["memory"]["held"], work["wanted_force"])
    for i in range(n):
        work["slack"][work["kept"][i]] = work["y"][0, i]


@kernel
def _inverse_mass(c, p):
    """ρ: the inverse mass that an upward push on a point finds in a walker with rigid joints."""
    at, R, z = c["at"], c["work"]["L"], c["work"]["z"]
    lane = LANES * (p // LEG_POINTS) + 3 * (p % LEG_POINTS)
    s = 0.0
    for i in range(BASE):
        t = at["A"][i, lane]
        for k in range(i):
            t -= R[k, i] * z[k]
        z[i] = t / R[i, i]
        s += z[i] * z[i]
    return s


@kernel
def _rigid_factor(c):
    """Leaves the factor of the base's block of M in work L."""
    R, M = c["work"]["L"], c["at"]["M_base"]
    for i in range(BASE):
        s = M[i, i]
        for k in range(i):
            s -= R[k, i] * R[k, i]
        R[i, i] = s**0.5
        for j in range(i + 1, BASE):
            s = M[i, j]
            for k in range(i):
                s -= R[k, i] * R[k, j]
            R[i, j] = s / R[i, i]


@kernel
def _prices(c, n):
    """Overwrites `slack` with what a force's square costs where its point is above the ground or is lifted."""
    work, act = c["work"], c["actuation"]
    _rigid_factor(c)
    last, rho = -1, 0.0
    for i in range(n):
        k = work["kept"][i]
        if k < N_EDGES:
            if k // EDGES != last:
                last = k // EDGES
                rho = _inverse_mass(c, last)
            scale = 1.0
        else:
            rho = act["regularisation"]
            scale = _SHANK
        away, slack = work["away"][k] / act["reach"], scale * work["slack"][k] / act["yielding"]
        work["slack"][k] = rho * (away * away + slack * slack)


@kernel
def _nearest_forces(c, n):
    """The second problem in the ground forces: leaves them in `force` and P (M q̈_d + h - Gᵀc) in work z."""
    work, tick, act, memory = c["work"], c["tick"], c["actuation"], c["memory"]
    forces = work["z"]
    for j in range(N):
        forces[j] = work["wanted"][j]
    for j in range(NU):
        free = memory["side"][j] == 0
        work["soft"][j] = 1.0 / act["regularisation"] if free else 0.0
        if not free:
            forces[BASE + j] -= memory["side"][j] * act["limit"][j]
    _reduce(c, n, work["soft"], forces)
    for i in range(n):
        work["H"][i, i] += work["slack"][work["kept"][i]]
    tick["changes"][1] = _solve(c, n, memory["pressed"], tick["force"])
    _left_over(c, n)


@kernel
def _left_over(c, n):
    """Leaves the motion of the forces in their lanes less that of the ground's in work z."""
    work, mu = c["work"], c["actuation"]["friction"]
    C, z, force = work["C"], work["y"][0], c["tick"]["force"]
    for i in range(BASE):
        z[i] = C[i, FORCE_LANE[0]] + C[i, FORCE_LANE[1]]
    for leg in range(LEGS):
        for i in range(LEG):
            z[BASE + LEG * leg + i] = C[BASE + i, FORCE_LANE[leg]]
    for j in range(n):
        k = work["kept"][j]
        s = force[k]
        if s == 0.0:
            continue
        if k < N_EDGES:
            leg = k // LEG_EDGES
            up = LANES * leg + 3 * (k % LEG_EDGES // EDGES)
            side = up + 1 + k % EDGES // 2
            t = mu * s if k % 2 == 0 else -mu * s
        else:
            leg = k - N_EDGES
            up = STOP_LANE[leg]
            side = up
            t = 0.0
        for i in range(BASE):
            z[i] -= s * C[i, up] + t * C[i, side]
        first = LEG * leg
        for i in range(BASE, BASE + LEG):
            z[first + i] -= s * C[i, up] + t * C[i, side]
    motion(c, z, work["z"])


@kernel
def _change_limits(c):
    """Writes the torques and moves the worst offender to or from its limit; returns whether there was one."""
    u, limit, side_of, x = c["tick"]["u"], c["actuation"]["limit"], c["memory"]["side"], c["work"]["z"]
    worst, which, side = _SLACK_OF_LIMIT, -1, 0
    for j in range(NU):
        wanted = x[BASE + j] / c["actuation"]["regularisation"]
        if side_of[j] == 0:
            u[j] = wanted
            beyond, to = abs(wanted) - limit[j], (1 if wanted > 0.0 else -1)
        else:
            u[j] = side_of[j] * limit[j]
            beyond, to = limit[j] - side_of[j] * wanted, 0
        if beyond > worst:
            worst, which, side = beyond, j, to
    if which >= 0:
        side_of[which] = side
    return which >= 0


@kernel
def _wanted_forces(c):
    """Writes M q̈_d + h = Q_d + Gᵀc_d into `wanted`."""
    work, A, mu = c["work"], c["at"]["A"], c["actuation"]["friction"]
    F = work["wanted"]
    for j in range(N):
        F[j] = c["tick"]["Q_d"][j]
    for p in range(N_POINTS):
        if work["near"][p] == 0:
            continue
        s = work["wanted_force"][EDGES * p : EDGES * p + EDGES]
        up, x, y = s[0] + s[1] + s[2] + s[3], mu * (s[0] - s[1]), mu * (s[2] - s[3])
        if up == 0.0:
            continue
        leg = p // LEG_POINTS
        lane = LANES * leg + 3 * (p % LEG_POINTS)
        for i in range(BASE + LEG):
            F[i if i < BASE else LEG * leg + i] += up * A[i, lane] + x * A[i, lane + 1] + y * A[i, lane + 2]
    for leg in range(LEGS):
        F[BASE + LEG * leg + KNEE] -= work["wanted_force"][N_EDGES + leg]


@kernel
def pushing_torques(c, m):
    """Writes the joint torques u (12,) [N m] for the record's Q_d; returns whether one of them is at its limit.

    Args:
        c: Controller record with sensed places and Q_d.
        m: `biped.control.spatial.places.Mechanics`.
    """
    tick, limit = c["tick"], c["actuation"]["limit"]
    n = unilateral_rows(c, m)
    lay_stops(c)
    wanted_motion(c, m, n)
    _prices(c, n)
    _wanted_forces(c)
    changes = 0
    for _ in range(_MOST_CHANGES):
        _nearest_forces(c, n)
        if not _change_limits(c):
            break
        changes += 1
    tick["changes"][2] = changes
    limited = False
    for j in range(NU):
        limited = limited or c["memory"]["side"][j] != 0
        tick["u"][j] = min(max(tick["u"][j], -limit[j]), limit[j])
    return limited
