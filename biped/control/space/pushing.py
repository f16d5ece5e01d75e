"""Joint torques for ground that only pushes, as in `biped.control.planar.pushing`, with a free base and eight points.

The two problems and their prices are those of the plane; an edge is one of four, n ± μ x and n ± μ y, of the pyramid
within a point's friction cone. Points so high that neither problem can want them are left out.
"""

import math

from biped.base.jit import inner_kernel, kernel
from biped.control.blending import downward
from biped.control.limits import MOST_CHANGES, WORST_FIRST, change_limits, coordinate
from biped.control.space.record import BASE, DIRECTIONS, EDGES, LEG, LEG_POINTS, LEGS, N_EDGES, N_POINTS, PLANE_EDGES
from biped.control.space.reduced import STOPS, factor, motion, products, weigh_forces, weigh_points, weigh_stops
from biped.numerics.lanes import LANES, added, load, store
from biped.numerics.quadratic import MOST, nonnegative

_TIE = 1e-9
"""Raises the diagonals by this fraction: sixteen forces share what six could do, and the shortest share is taken."""
FAR = 300.0
"""[m/s²] A point with a larger gap is left out: a force there would cost a thousand times what it does."""


@inner_kernel
def unilateral_rows(c, m):
    """Lists the forces that count: least accelerations along them, and how far what exerts them is from pushing.

    Returns:
        Their number: four edges of each point that is near the ground, in the plane two, then the knees' stops, then
        those that are near of the other joints.
    """
    at, work, act, memory, belief = c["at"], c["work"], c["actuation"], c["memory"], c["belief"]
    upper = work["R_base"].shape[0]
    tau, mu = act["approach"], act["friction"]
    edges, n = belief["edges"], 0
    for p in range(N_POINTS):
        leg = p // LEG_POINTS
        if p % LEG_POINTS == 0:
            work["standing"][leg] = 0
        gap = downward(at["speed"][p], at["height"][p], tau, act["braking"])
        work["near"][p] = 1 if gap < FAR and not belief["twin"][p] else 0
        if work["near"][p] == 0:
            for k in range(EDGES * p, EDGES * p + EDGES):
                memory["held"][k] = 0
                memory["pressed"][k] = 0
            continue
        work["standing"][leg] = 1
        bias = at["bias"][p]
        for e in range(edges):
            slope = mu if e % 2 == 0 else -mu
            work["least"][n] = -bias[0] - slope * bias[1 + e // 2] - gap
            work["away"][n] = max(0.0, at["height"][p])
            work["kept"][n] = EDGES * p + e
            work["up"][n] = LANES * leg + DIRECTIONS * (p % LEG_POINTS)
            work["across"][n] = work["up"][n] + 1 + e // 2
            work["slope"][n] = slope
            n += 1
    work["edges"] = n
    for one in range(work["stop"].shape[0]):
        way, at_leg = belief["stop_way"][one], upper + LEG * belief["stop_leg"][one]
        j = at_leg + belief["stop_joint"][one]
        room, rate = way * (m.q[belief["place"][j]] - belief["stop_end"][one]), way * at["v"][j]
        gap = max(0.0, 2.0 * rate / tau + room / (tau * tau))
        if one == LEGS:
            work["knees"] = n
        if one >= LEGS and gap * belief["shank"] > FAR:
            memory["held"][N_EDGES + one] = 0
            continue
        work["least"][n] = -gap
        work["away"][n] = belief["shank"] * max(0.0, room)
        work["kept"][n] = N_EDGES + one
        n += 1
    if work["stop"].shape[0] == LEGS:
        work["knees"] = n
    return n


@kernel
def _reduce(c, n, top):
    """Fills H (n, n) of the forces that count and breaks its ties; f holds what the weighed `forces` do along them.

    Args:
        c: Controller record.
        n: Number of forces.
        top: By what ties are broken, 0: by the largest diagonal. It changes torques by up to 3e-4 of them.

    Returns:
        By what ties were broken.
    """
    work = c["work"]
    H, f, D, row, x, stop = work["H"], work["f"], work["D"], work["row"][0], work["forces"], work["stop"]
    up, across, slope, edges, mu = work["up"], work["across"], work["slope"], work["edges"], c["actuation"]["friction"]
    kept, of_leg, of_joint = work["kept"], c["belief"]["stop_leg"], c["belief"]["stop_joint"]
    of_point = c["belief"]["edges"]
    upper, reach, all_forces = work["R_base"].shape[0], work["W"].shape[2], STOPS + stop.shape[0]
    factor(c, work["soft"])
    weigh_points(c)
    weigh_stops(c)
    weigh_forces(c, x)
    products(c, x)
    largest = 0.0
    for i in range(edges):
        for leg in range(up[i] // LANES + 1):
            if work["standing"][leg]:
                s = added(load(D, LEGS * up[i] + leg), slope[i], load(D, LEGS * across[i] + leg))
                store(work["row"], leg, s)
        for j in range(0, i + 1, of_point):  # the edges of a point; those after i are written again
            lane = up[j]
            rise, x_part, y_part = row[lane], mu * row[lane + 1], mu * row[lane + 2]
            H[i, j] = H[j, i] = rise + x_part
            H[i, j + 1] = H[j + 1, i] = rise - x_part
            if of_point == EDGES:
                H[i, j + 2] = H[j + 2, i] = rise + y_part
                H[i, j + 3] = H[j + 3, i] = rise - y_part
        largest = max(largest, H[i, i])
        f[0, i] = D[all_forces, up[i]] + slope[i] * D[all_forces, across[i]]
    for i in range(edges, n):
        one = kept[i] - N_EDGES
        leg, joint = of_leg[one], of_joint[one]
        for j in range(edges):
            H[i, j] = D[STOPS + one, up[j]] + slope[j] * D[STOPS + one, across[j]]
            H[j, i] = H[i, j]
        s = 0.0
        for k in range(reach):
            s += stop[one, k] * x[upper - reach + k]
        for k in range(joint, LEG):
            s += stop[one, reach + k] * x[upper + LEG * leg + k]
        f[0, i] = s
        for j in range(edges, i + 1):
            other = kept[j] - N_EDGES
            s = 0.0
            for k in range(reach + LEG if leg == of_leg[other] else reach):
                s += stop[one, k] * stop[other, k]
            H[i, j] = s
            H[j, i] = s
        largest = max(largest, H[i, i])
    if top == 0.0:
        top = largest
    for i in range(n):
        H[i, i] += _TIE * top
    return top


@kernel
def _solve(c, n, remembered):
    """Solves the problem in its forces x, with multipliers y, from the remembered set."""
    work = c["work"]
    kept, free = work["kept"], work["free"]
    for i in range(n):
        free[i] = remembered[kept[i]]
    changes = nonnegative(work["H"], work["f"], n, free, work["order"], work["U"], work["L"], work["x"], work["y"])
    for i in range(n):
        remembered[kept[i]] = free[i]
    if changes == MOST:
        c["tick"]["given_up"] += 1
    return changes


@inner_kernel
def wanted_motion(c, m, n):
    """The first problem: leaves its ground forces c_d in work x, what is left over of the inequalities in work y."""
    work, tick, column = c["work"], c["tick"], c["belief"]["column"]
    for j in range(column.size):
        work["forces"][j] = tick["Q_d"][j] - m.h[column[j]] if column[j] >= 0 else 0.0
    for j in range(work["soft"].size):
        work["soft"][j] = 0.0
    _reduce(c, n, 0.0)
    for i in range(n):
        work["f"][0, i] = work["least"][i] - work["f"][0, i]
    tick["changes"][0] = _solve(c, n, c["memory"]["held"])


@kernel
def _rigid_factor(c):
    """Leaves the inverse factor of the base's block of M, of a walker with rigid joints, in work L."""
    R, M = c["work"]["L"], c["at"]["M_base"]
    trunk = M.shape[0] - BASE
    for i in range(BASE):
        s = M[trunk + i, trunk + i]
        for k in range(i):
            s -= R[k, i] * R[k, i]
        R[i, i] = 1.0 / math.sqrt(s)
        for j in range(i + 1, BASE):
            s = M[trunk + i, trunk + j]
            for k in range(i):
                s -= R[k, i] * R[k, j]
            R[i, j] = s * R[i, i]


@kernel
def _inverse_mass(c, lane, across, slope):
    """ρ: the inverse mass that a push along two directions finds in a walker with rigid joints."""
    A, R, z = c["at"]["A"], c["work"]["L"], c["work"]["row"][0]
    shared, total = A.shape[0] - LEG - BASE, 0.0
    for i in range(BASE):
        s = A[shared + i, lane] + slope * A[shared + i, across]
        for k in range(i):
            s -= R[k, i] * z[k]
        z[i] = s * R[i, i]
        total += z[i] * z[i]
    return total


@kernel
def _prices(c, n):
    """Fills what a force's square costs where its point is above the ground or is lifted."""
    work, act = c["work"], c["actuation"]
    _rigid_factor(c)
    last, rho, plane = -1, 0.0, c["belief"]["edges"] == PLANE_EDGES
    for i in range(n):
        if i < work["edges"]:
            scale = 1.0
            if plane:  # along the edge itself; in space along the vertical alone, once for four edges
                rho = _inverse_mass(c, work["up"][i], work["across"][i], work["slope"][i])
            elif work["up"][i] != last:
                last = work["up"][i]
                rho = _inverse_mass(c, last, last, 0.0)
        else:
            scale = c["belief"]["shank"]  # its angle counts as a distance
            rho = act["regularisation"]
        away, slack = work["away"][i] / act["reach"], scale * work["y"][0, i] / act["yielding"]
        work["price"][i] = rho * (away * away + slack * slack)


@kernel
def _add_contacts(work, G, sign, F):
    """Adds what the points' forces in work x do along the coordinates, through the directions G, with a sign."""
    upper, reach = work["R_base"].shape[0], work["W"].shape[2]
    for i in range(work["edges"]):
        s = sign * work["x"][0, i]
        if s != 0.0:
            up, across, t = work["up"][i], work["across"][i], s * work["slope"][i]
            lead, first = upper - reach, upper + LEG * (up // LANES)
            for j in range(reach):
                F[lead + j] += s * G[j, up] + t * G[j, across]
            for j in range(LEG):
                F[first + j] += s * G[reach + j, up] + t * G[reach + j, across]


@inner_kernel
def _wanted_forces(c, n):
    """Writes M q̈_d + h = Q_d + Gᵀc_d into `wanted`, and adds what joints do by themselves, which motors make up for."""
    work, belief, F = c["work"], c["belief"], c["work"]["wanted"]
    upper = work["R_base"].shape[0]
    for j in range(F.size):
        F[j] = c["tick"]["Q_d"][j]
    _add_contacts(work, c["at"]["A"], 1.0, F)
    for i in range(work["edges"], n):
        one = work["kept"][i] - N_EDGES
        j = upper + LEG * belief["stop_leg"][one] + belief["stop_joint"][one]
        F[j] += belief["stop_way"][one] * work["x"][0, i]
    for j in range(F.size):
        F[j] += c["tick"]["passive"][j]


@kernel
def _nearest_forces(c, n, top):
    """The second problem in the ground forces c: leaves them in work x, and P (M q̈_d + h - Gᵀc) in `forces`.

    `top`, which it returns, is as in `_reduce`.
    """
    work, act, memory = c["work"], c["actuation"], c["memory"]
    F, C = work["forces"], work["C"]
    upper, reach = work["R_base"].shape[0], work["W"].shape[2]
    for j in range(F.size):
        F[j] = work["wanted"][j]
    for j in range(work["soft"].size):
        free = memory["side"][j] == 0
        work["soft"][j] = 1.0 / act["regularisation"] if free else 0.0
        if not free:
            F[coordinate(j, upper - BASE, BASE)] -= memory["side"][j] * act["limit"][j]
    top = _reduce(c, n, top)
    for i in range(n):
        work["H"][i, i] += work["price"][i]
    for i in range(work["edges"], n):
        work["x"][0, i] = 0.0
    c["tick"]["changes"][1] = _solve(c, work["knees"] if act["stops"] else work["edges"], memory["pressed"])
    _add_contacts(work, C, -1.0, F)
    for i in range(work["edges"], work["knees"]):
        s = work["x"][0, i]
        if s != 0.0:
            one = work["kept"][i] - N_EDGES
            leg, joint = c["belief"]["stop_leg"][one], c["belief"]["stop_joint"][one]
            for j in range(reach):
                F[upper - reach + j] -= s * work["stop"][one, j]
            for j in range(joint, LEG):
                F[upper + LEG * leg + j] -= s * work["stop"][one, reach + j]
    motion(c, F)
    return top


@inner_kernel
def pushing_torques(c, m):
    """Writes the joint torques u [N m], in the law's order, for the record's Q_d; returns whether one is at its limit.

    Args:
        c: Controller record with sensed places, the points' motion and Q_d.
        m: `biped.control.space.places.Mechanics`.
    """
    tick, limit = c["tick"], c["actuation"]["limit"]
    tick["given_up"] = 0
    n = unilateral_rows(c, m)
    wanted_motion(c, m, n)
    _prices(c, n)
    _wanted_forces(c, n)
    shared, weight = limit.size - LEGS * LEG, c["actuation"]["regularisation"]
    top = 0.0
    for turn in range(MOST_CHANGES):
        top = _nearest_forces(c, n, top if turn > WORST_FIRST else 0.0)  # a descent needs the same ties throughout
        tick["changes"][2] = turn
        if not change_limits(turn, c["work"]["forces"], shared, BASE, weight, limit, c["memory"]["side"], tick["u"]):
            break
    else:
        tick["given_up"] += 1
    for k in range(tick["force"].size):
        tick["force"][k] = 0.0
    for i in range(c["work"]["knees"]):
        tick["force"][c["work"]["kept"][i]] = c["work"]["x"][0, i]
    limited = False
    for j in range(limit.size):
        limited = limited or c["memory"]["side"][j] != 0
        tick["u"][j] = min(max(tick["u"][j], -limit[j]), limit[j])
    return limited
