"""The motion under active constraints whose rows are independent, which they nearly always are: a row in each lane.

M = LᵀL from the feet up, C = A L⁻¹ and C H = [Λ 0] by reflections. With f the forces, g = HᵀL⁻ᵀf and z = Λ⁻¹b_v,

    v̇ = L⁻¹H [z; g past the rows],   λ = Λ⁻ᵀ(z - g),   and for the corrections W d = L⁻¹H [Λ⁻¹d; 0].

The three stand in three lanes. Where only forces change, all but g stays.
"""

from biped.base.jit import kernel
from biped.engines.rigid.gauss import RANK, bias_on, keeps_place, off_ground, row_on
from biped.numerics.factor import factor_lanes, reflect, reflect_few_back, solve_few, solve_lanes_transposed
from biped.numerics.lanes import added, everywhere, load, lone, store
from biped.robot.planar.topology import KNEE, N_POINTS, N_ROWS, N_STOPS, NQ, STOP_ROW, X
from biped.robot.planar.weighing import coupled, factor_from_feet, unweigh, weigh

F_LANE = N_ROWS
"""Lane in which the forces are weighed and reflected along with the rows."""
_ACCELERATION, _VELOCITY, _SHIFT = 0, 1, 2
"""Lanes of what is solved for."""


@kernel
def respond(w, q, v):
    """Leaves the constrained motion under work f, see `biped.engines.rigid.motion.evaluate`.

    Args:
        w: Record with M, h, places and gaps.
        q: (9,) joint coordinates [m, rad].
        v: (9,) joint velocities.

    Returns:
        Whether the active rows are independent; nothing is left if they are not.
    """
    rows, motion = w["rows"], w["motion"]
    A, C, L, b_v, d, solved = rows["A"], rows["C"], rows["L"], rows["b_v"], rows["d"], rows["X"]
    m = _rows_in_lanes(w)
    rows["count"] = m
    for j in range(NQ):
        A[j, F_LANE] = w["work"]["f"][j]
    factor_from_feet(w["system"]["M"], rows["spring"], L)
    weigh(A, L, C)
    independent = factor_lanes(C, rows["kept"], m, RANK, rows["pivot"], rows["V"], rows["tau"])
    rows["independent"] = independent
    if not independent:
        return False
    speed = everywhere(0.0)
    for j in range(NQ):
        speed = added(speed, -v[j], load(A, j))
    store(rows["speed"], 0, speed)
    for i in range(m):
        k = rows["pivot"][i]
        d[k, _ACCELERATION], d[k, _VELOCITY], d[k, _SHIFT] = b_v[0, k], rows["speed"][0, k], -residual(w, q, k)
    solve_motion(w, m)
    for j in range(NQ):
        motion["v_dot"][j] = solved[j, _ACCELERATION]
        motion["q_dot"][j] = v[j] + solved[j, _VELOCITY]
        motion["shift"][j] = solved[j, _SHIFT]
    return True


@kernel
def respond_again(w):
    """Leaves v̇ and the multipliers under another work f, all else as `respond` found it."""
    rows, x, m = w["rows"], w["work"]["f"], w["rows"]["count"]
    L = rows["L"]
    for i in range(NQ - 1, -1, -1):
        x[i] /= L[i, i]
        for j in range(i):
            if coupled(i, j):
                x[j] -= L[i, j] * x[i]
    reflect(rows["V"], m, NQ, rows["tau"], x)
    for j in range(NQ):
        rows["C"][j, F_LANE] = x[j]
    solve_motion(w, m)
    for j in range(NQ):
        w["motion"]["v_dot"][j] = rows["X"][j, _ACCELERATION]


@kernel
def solve_motion(w, m):
    """Solves for the multipliers and all lanes of X, the acceleration's from g and b_v."""
    rows, z, lam = w["rows"], w["work"]["z"], w["motion"]["lam"]
    C, solved = rows["C"], rows["X"]
    solve_few(C, rows["pivot"], m, rows["d"], solved)
    for i in range(m):
        z[i] = solved[i, _ACCELERATION] - C[i, F_LANE]
    for i in range(m, NQ):
        store(solved, i, lone(C[i, F_LANE]))
    for row in range(N_ROWS):
        lam[row] = 0.0
    solve_lanes_transposed(C, rows["pivot"], m, z, lam)
    reflect_few_back(rows["V"], rows["tau"], m, solved)
    unweigh(rows["L"], solved)


@kernel
def _rows_in_lanes(w):
    """Writes the active rows of A into their lanes, b_v = -J̇v, and which lanes are rows; returns how many."""
    rows, contact, active = w["rows"], w["contact"], w["contact"]["active"]
    A, b_v, kept = rows["A"], rows["b_v"], rows["kept"]
    for j in range(NQ):
        store(A, j, everywhere(0.0))
    store(b_v, 0, everywhere(0.0))
    store(kept, 0, everywhere(0.0))
    m = 0
    for i in range(N_POINTS):
        if active[i]:
            for direction in range(2):
                if direction == 1 and not keeps_place(contact, i):
                    continue
                k = 2 * i + direction
                row_on(w, i, direction, A[:, k])
                b_v[0, k] = -bias_on(w, i, direction)
                kept[0, k] = 1.0
                m += 1
    for leg in range(N_STOPS):
        if active[N_POINTS + leg]:
            A[KNEE[leg], STOP_ROW + leg] = -1.0
            kept[0, STOP_ROW + leg] = 1.0
            m += 1
    return m


@kernel
def residual(w, q, row):
    """Φ of a row [m, rad]: height, place along the ground minus where it landed, angle to the knee stop."""
    system = w["system"]
    if row >= STOP_ROW:
        return system["gap"][row - STOP_ROW + N_POINTS]
    i = row // 2
    if w["ground"]["count"] > 0:
        return off_ground(w, q, i, row % 2)
    return system["gap"][i] if row % 2 == 0 else q[X] + w["at"]["point"][i, 0] - w["contact"]["anchor"][i]
