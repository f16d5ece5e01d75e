"""Joint torques (3.15) from the three floating coordinates alone: what the allocation finds, in a third of the time.

What the actuators do not drive are the torso's three coordinates b; a are the six joints. With f = E u - Q_d - Aᵀμ,

    ‖N R⁻ᵀ(E u - Q_d)‖² = min over μ of fᵀM⁻¹f,

because N takes away what lies in the range of Cᵀ = R⁻ᵀAᵀ. The joint forces in f are free through u; at their best
M⁻¹f has no joint part, and f_bᵀ M_bb⁻¹ f_b of the floating coordinates is left. So μ minimises ‖Q_b + A_bᵀμ‖ in the
metric of M_bb⁻¹, the torso accelerates by a_b = -M_bb⁻¹(Q_b + A_bᵀμ), and

    u = Q_a + A_aᵀμ + M_ab a_b,   of least norm over the μ in the null space of A_bᵀ.

Rows of A stand in lanes: what is done to one row is done to all. Row number `Q_LANE` carries along Q_d, in which u
appears. Which rows count is decided as in the allocation, by the pivots of C = A L⁻¹ with M = LᵀL; L begins at the
feet and so keeps the zeros between the legs.
"""

import math

from biped.base.jit import inner_kernel, kernel
from biped.control.planar.allocation import clip_torques
from biped.control.planar.constraints import NO_ROW, believed_bias, candidates
from biped.numerics.lanes import added, everywhere, largest, load, placed, plus, squared, store, times, total
from biped.robot.planar.kinematics import point_row
from biped.robot.planar.topology import BASE, HEEL, KNEE, N_POINTS, N_ROWS, N_STOPS, NQ, NU, STOP_ROW
from biped.robot.planar.weighing import factor_from_feet, factor_torso, weigh, weigh_torso

Q_LANE = N_ROWS


@inner_kernel
def floating_torques(c, M, q):
    """Writes the joint torques u (6,) [N m] for the record's Q_d.

    Args:
        c: Controller record with sensed links and Q_d, believing in the tree as it is.
        M: (9, 9) mass matrix, upper triangle.
        q: (9,) joint coordinates.

    Returns:
        Whether a torque limit was exceeded.
    """
    tick, actuation, rows = c["tick"], c["actuation"], c["rows"]
    active = tick["active"]
    candidates(c, q)
    # What is written number by number is read as lanes only after the factor, when it has arrived.
    _rows_in_lanes(c)
    tick["rows"] = _keep(c)
    if actuation["release"]:
        believed_bias(c)
        for j in range(NQ):
            rows["A"][j, Q_LANE] = tick["Q_d"][j] - tick["h"][j]
    factor_from_feet(M, rows["spring"], rows["L"])
    weigh(rows["A"], rows["L"], rows["C"])
    while True:
        tick["rank"] = _independent_rows(rows, actuation["tolerance"], tick["rows"])
        if actuation["release"] == 0 or tick["rows"] == 0:
            break
        _constraint_forces(rows, tick["rank"])
        worst, drop = -actuation["release_force"], NO_ROW
        for i in range(N_POINTS):
            if active[i] and rows["force"][0, 2 * i] < worst:
                worst, drop = rows["force"][0, 2 * i], i
        if drop == NO_ROW:
            break
        active[drop] = 0
        tick["rows"] = _keep(c)
    _least_torques(c, M)
    return clip_torques(c)


@kernel
def _rows_in_lanes(c):
    """Writes the candidates' rows of A into their lanes, and b_v = -J̇v; all other lanes are zero."""
    rows, at, active = c["rows"], c["at"], c["tick"]["active"]
    A, b_v = rows["A"], rows["b_v"]
    for j in range(NQ):
        store(A, j, everywhere(0.0))
    store(b_v, 0, everywhere(0.0))
    for i in range(N_POINTS):
        if active[i]:
            for direction in range(2):
                point_row(at, i, direction, A[:, 2 * i + direction])
                b_v[0, 2 * i + direction] = -at["point_bias"][i, 1 - direction]
    for leg in range(N_STOPS):
        if active[N_POINTS + leg]:
            A[KNEE[leg], STOP_ROW + leg] = 1.0


@kernel
def _keep(c):
    """Marks the lanes of rows that are in A now, with 1, and the others with 0; returns how many there are."""
    active, kept = c["tick"]["active"], c["rows"]["kept"]
    store(kept, 0, everywhere(0.0))
    m = 0
    for i in range(N_POINTS):
        if active[i]:
            kept[0, 2 * i] = 1.0
            m += 1
            # With `single_tangential` a flat foot has the heel's tangential row alone: the toe's says the same.
            if c["actuation"]["single_tangential"] == 0 or i in HEEL or active[i + 1] == 0:
                kept[0, 2 * i + 1] = 1.0
                m += 1
    for leg in range(N_STOPS):
        if active[N_POINTS + leg]:
            kept[0, STOP_ROW + leg] = 1.0
            m += 1
    return m


@kernel
def _independent_rows(rows, tolerance, count):
    """Orthonormalises rows of C, always the longest remainder next, and takes them from `free`; returns their number.

    A row is dependent once its remainder is below `tolerance` times the longest row; `count` rows are kept. V keeps,
    step by step, every row's part along the pivot: C = VᵀQ with orthonormal rows Q.
    """
    C, E, V = rows["C"], rows["E"], rows["V"]
    mask, free = load(rows["kept"], 0), everywhere(1.0)
    zero = everywhere(0.0)
    a = b = c = zero
    for j in range(0, NQ, 3):
        x, y, z = times(load(C, j), mask), times(load(C, j + 1), mask), times(load(C, j + 2), mask)
        store(E, j, x)
        store(E, j + 1, y)
        store(E, j + 2, z)
        a, b, c = squared(a, x), squared(b, y), squared(c, z)
    least, rank = 0.0, 0
    while rank < NQ:
        best, p = largest(times(plus(plus(a, b), c), free))
        if rank == 0:
            least = tolerance * tolerance * best
        if not best > least:
            break
        free = placed(free, p, 0.0)
        scale = 1.0 / math.sqrt(best)
        a = b = c = zero
        for j in range(0, NQ, 3):
            a = added(a, E[j, p], load(E, j))
            b = added(b, E[j + 1, p], load(E, j + 1))
            c = added(c, E[j + 2, p], load(E, j + 2))
        along = times(everywhere(scale), plus(plus(a, b), c))
        store(V, rank, along)
        rank += 1
        if rank == count:
            break  # nothing is left of any row
        a = b = c = zero
        for j in range(0, NQ, 3):
            x = added(load(E, j), -scale * E[j, p], along)
            y = added(load(E, j + 1), -scale * E[j + 1, p], along)
            z = added(load(E, j + 2), -scale * E[j + 2, p], along)
            store(E, j, x)
            store(E, j + 1, y)
            store(E, j + 2, z)
            a, b, c = squared(a, x), squared(b, y), squared(c, z)
    store(rows["free"], 0, free)
    return rank


@kernel
def _constraint_forces(rows, rank):
    """Minimum-norm multipliers λ = (CCᵀ)⁺(b_v - A a) [N, N m] of the motion under Q_d, in `force` by lane.

    With C = VᵀQ and V's rows orthonormalised, V = TᵀW, they are λ = Wᵀ T⁻ᵀT⁻¹ W(b_v - A a).
    """
    C, V, T, z = rows["C"], rows["V"], rows["T"], rows["z"]
    left = load(rows["b_v"], 0)
    for j in range(NQ):
        left = added(left, -C[j, Q_LANE], load(C, j))
    left = times(left, load(rows["kept"], 0))
    # A row's part along a finished one is taken from all that follow at once: they do not wait for each other.
    for s in range(rank):
        x = load(V, s)
        T[s, s] = 1.0 / math.sqrt(total(times(x, x)))  # its inverse
        x = times(everywhere(T[s, s]), x)
        store(V, s, x)
        z[s] = total(times(x, left))
        left = added(left, -z[s], x)
        for t in range(s + 1, rank):
            y = load(V, t)
            T[s, t] = total(times(y, x))
            store(V, t, added(y, -T[s, t], x))
    for s in range(rank - 1, -1, -1):
        f = z[s]
        for t in range(s + 1, rank):
            f -= T[s, t] * z[t]
        z[s] = f * T[s, s]
    force = everywhere(0.0)
    for s in range(rank):
        f = z[s]
        for t in range(s):
            f -= T[t, s] * z[t]
        z[s] = f * T[s, s]
        force = added(force, z[s], load(V, s))
    store(rows["force"], 0, force)


@kernel
def _least_torques(c, M):
    """Writes u for the rows that are not `free`."""
    rows, actuation, Q_d, u = c["rows"], c["actuation"], c["tick"]["Q_d"], c["tick"]["u"]
    A, D, Y = rows["A"], rows["D"], rows["Y"]
    mask = added(everywhere(1.0), -1.0, load(rows["free"], 0))
    for j in range(BASE):
        store(D, j, placed(times(mask, load(A, j)), Q_LANE, Q_d[j]))
    for j in range(NU):
        wanted = Q_d[BASE + j]
        if actuation["use_u_0"]:
            wanted -= actuation["u_0"][j]
        store(Y, j, placed(times(mask, load(A, BASE + j)), Q_LANE, wanted))
    reached = _float(rows, M, actuation["tolerance"])
    _shorten(rows, c["tick"]["rank"] - reached)
    for j in range(NU):
        u[j] = Y[j, Q_LANE]
        if actuation["use_u_0"]:
            u[j] += actuation["u_0"][j]


@kernel
def _float(rows, M, tolerance):
    """Makes the torso move as Q_d would, as far as the rows can: μ in the range of A_b, and a_b; returns A_b's rank.

    Rows are combined so that the floating parts of the pivots are orthonormal in the metric of M_bb⁻¹ = (SᵀS)⁻¹, and
    those of all others zero.
    """
    D, Y, S = rows["D"], rows["Y"], rows["S"]
    factor_torso(M, S)
    weigh_torso(S, D)
    x, y, z = load(D, 0), load(D, 1), load(D, 2)
    free = placed(everywhere(1.0), Q_LANE, 0.0)
    least, reached = 0.0, 0
    for step in range(BASE):
        best, p = largest(times(squared(squared(times(x, x), y), z), free))
        if step == 0:
            least = tolerance * tolerance * best
        if not best > least:
            break
        free = placed(free, p, 0.0)
        reached += 1
        scale = 1.0 / math.sqrt(best)
        ex, ey, ez = scale * D[0, p], scale * D[1, p], scale * D[2, p]
        along = added(added(times(everywhere(ex), x), ey, y), ez, z)
        x, y, z = added(x, -ex, along), added(y, -ey, along), added(z, -ez, along)
        store(D, 0, x)
        store(D, 1, y)
        store(D, 2, z)
        for j in range(NU):
            store(Y, j, added(load(Y, j), -scale * Y[j, p], along))
    store(rows["free"], 0, free)
    if reached < BASE:
        # (With three, nothing of Q_b is left for the torso to accelerate by.)
        a_x = -D[0, Q_LANE] / S[0, 0]
        a_y = (-D[1, Q_LANE] - S[1, 0] * a_x) / S[1, 1]
        a_z = (-D[2, Q_LANE] - S[2, 0] * a_x - S[2, 1] * a_y) / S[2, 2]
        for j in range(NU):
            Y[j, Q_LANE] += M[0, BASE + j] * a_x + M[1, BASE + j] * a_y + M[2, BASE + j] * a_z
    return reached


@kernel
def _shorten(rows, count):
    """Takes from u what the `count` rows that are left, whose floating parts are zero, can give without it."""
    Y, free = rows["Y"], load(rows["free"], 0)
    for _ in range(count):
        a = b = everywhere(0.0)
        for j in range(0, NU, 2):
            a, b = squared(a, load(Y, j)), squared(b, load(Y, j + 1))
        best, p = largest(times(plus(a, b), free))
        if not best > 0.0:
            return
        free = placed(free, p, 0.0)
        scale = 1.0 / math.sqrt(best)
        a = b = everywhere(0.0)
        for j in range(0, NU, 2):
            a, b = added(a, Y[j, p], load(Y, j)), added(b, Y[j + 1, p], load(Y, j + 1))
        along = times(everywhere(scale), plus(a, b))
        for j in range(NU):
            store(Y, j, added(load(Y, j), -scale * Y[j, p], along))
