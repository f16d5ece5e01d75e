"""The constraints imposed on the robot: rows of A, their forces, and the release test that decides which ones count.

Read literally, (3.15) treats every row of A as bilateral, and Q_d then asks the ground to pull on toes and heels. The
release test keeps a row only "when imposed on the robot": a point whose normal force would have to pull harder than
`release_force` is not a constraint, and is dropped before the torques are computed.
"""

from biped.base.jit import inner_kernel, kernel
from biped.numerics.factor import (
    cholesky,
    factor_rows,
    least_squares,
    solve_transposed,
    solve_upper,
    transposed_minimum_norm,
    weigh_rows,
)
from biped.robot.planar.kinematics import bias_forces, point_row
from biped.robot.planar.topology import ANKLE, BASE, HEEL, HIP, KNEE, LEGS, N_POINTS, N_STOPS, NQ, PITCH, STOP_ROW

NO_ROW = -1


@inner_kernel
def candidates(c, q):
    """Marks the points that touch and the knees that are at their stop: the constraints that may be imposed."""
    tick, sensing = c["tick"], c["sensing"]
    active = tick["active"]
    for i in range(N_POINTS):
        active[i] = 1 if tick["height"][i] < sensing["contact_height"] else 0
    for leg in range(N_STOPS):
        active[N_POINTS + leg] = 1 if -q[KNEE[leg]] < sensing["knee_angle"] else 0


@kernel
def constraint_rows(c):
    """Builds A (m, 9) and b_v = -J̇v (m,) of the active constraints; returns m.

    Row 2i is a point's normal direction, row 2i + 1 its tangential one; the knees follow. With `single_tangential`, a
    flat foot has one tangential row (the heel's): the toe's says the same thing.
    """
    work, at, belief = c["work"], c["at"], c["belief"]
    A, b_v, row, active = work["A"], work["b_v"], work["row"], c["tick"]["active"]
    bias = at["point_bias"]
    m = 0
    for i in range(N_POINTS):
        if active[i] == 0:
            continue
        alone = c["actuation"]["single_tangential"] == 0 or i in HEEL or active[i + 1] == 0
        for direction in range(2):
            if direction == 1 and not alone:
                continue
            point_row(at, i, direction, A[m])
            b_v[m] = -bias[i, 1 - direction]
            row[m] = 2 * i + direction
            m += 1
    for leg in range(N_STOPS):
        if active[N_POINTS + leg]:
            for j in range(NQ):
                A[m, j] = 0.0
            A[m, KNEE[leg]] = 1.0
            b_v[m] = 0.0
            row[m] = STOP_ROW + leg
            m += 1
    if belief["perturbed"]:
        for i in range(m):
            perturb_row(c, A[i], belief["row_factor"][row[i]])
    return m


@kernel
def perturb_row(c, a, factor):
    """Multiplies a row of A by `factor` elementwise in the thesis's absolute coordinates, where the row is defined.

    a·q̇ with joint rates = a'·(absolute rates): along a leg a' is the difference of neighbouring joint entries.
    """
    for leg in range(LEGS):
        hip, knee, ankle = HIP[leg], KNEE[leg], ANKLE[leg]
        shank, foot = a[knee] - a[ankle], a[ankle]
        thigh = a[hip] - a[knee]
        a[PITCH] -= a[hip]
        foot *= factor[ankle]
        shank *= factor[knee]
        thigh *= factor[hip]
        a[ankle] = foot
        a[knee] = foot + shank
        a[hip] = foot + shank + thigh
    for j in range(BASE):
        a[j] *= factor[j]
    a[PITCH] += a[HIP[0]] + a[HIP[1]]


@inner_kernel
def believed_bias(c):
    """Fills the tick's bias forces h, unless they are somebody else's."""
    if c["tick"]["given"] == 0:
        bias_forces(c["tree"], c["at"], c["belief"]["gravity"], c["tick"]["h"])


@kernel
def believed_mass(c, M):
    """Cholesky factor R of the controller's mass matrix, M = RᵀR; elementwise wrong if the record says so."""
    belief, work = c["belief"], c["work"]
    if belief["perturbed"] == 0:
        cholesky(M, work["R"])
        return
    perturbed_mass(M, belief["mass_factor"], work["M"])
    cholesky(work["M"], work["R"])


@kernel
def perturbed_mass(M, factor, full):
    """Fills `full`: M multiplied elementwise by `factor` in the thesis's absolute coordinates, back in joint ones.

    Args:
        M: (9, 9) mass matrix, upper triangle.
        factor: (9, 9), upper triangle.
        full: (9, 9) result, both triangles.
    """
    for i in range(NQ):
        for j in range(NQ):
            full[i, j] = M[min(i, j), max(i, j)]
    for sweep in range(2):  # rows, then columns: joint -> absolute
        for i in range(NQ):
            line = full[i] if sweep == 0 else full[:, i]
            for leg in range(LEGS):
                line[PITCH] -= line[HIP[leg]]
                line[HIP[leg]] -= line[KNEE[leg]]
                line[KNEE[leg]] -= line[ANKLE[leg]]
    for i in range(NQ):
        for j in range(NQ):
            full[i, j] *= factor[min(i, j), max(i, j)]
    for sweep in range(2):
        for i in range(NQ):
            line = full[i] if sweep == 0 else full[:, i]
            for leg in range(LEGS):
                line[KNEE[leg]] += line[ANKLE[leg]]
                line[HIP[leg]] += line[KNEE[leg]]
                line[PITCH] += line[HIP[leg]]


@kernel
def factor_constraints(c, m):
    """Factors C = A R⁻¹ (m, 9) into the record; returns its rank."""
    work = c["work"]
    C = work["C"]
    weigh_rows(work["A"], work["R"], m, C)
    return factor_rows(C, m, NQ, c["actuation"]["tolerance"], work["tau"], work["pivot"])


@kernel
def constraint_forces(c, m, rank):
    """Minimum-norm multipliers λ (m,) [N, N m] of the motion under Q_d, (3.6)-(3.7): λ = (CCᵀ)⁺(b_v - A a)."""
    work, tick = c["work"], c["tick"]
    d, z, x = work["d"], work["z"], work["a"]
    for j in range(NQ):
        x[j] = tick["Q_d"][j] - tick["h"][j]
    solve_transposed(work["R"], x)  # R a
    solve_upper(work["R"], x)  # a
    for i in range(m):
        s = work["b_v"][i]
        for j in range(NQ):
            s -= work["A"][i, j] * x[j]
        d[i] = s
    least_squares(work["C"], m, rank, work["pivot"], work["L"], work["tau2"], d, z)
    transposed_minimum_norm(work["C"], m, rank, work["pivot"], work["L"], work["tau2"], z, work["force"])


@kernel
def imposed_constraints(c, q):
    """Leaves the factored constraints that are imposed on the robot in the record; returns (m, rank).

    Starting from the candidates, the point that would be pulled hardest is dropped until none is pulled harder than
    `release_force`; without the release test all candidates stay.
    """
    actuation, tick, work = c["actuation"], c["tick"], c["work"]
    candidates(c, q)
    if actuation["release"]:
        believed_bias(c)  # nothing else needs them
    while True:
        m = constraint_rows(c)
        rank = factor_constraints(c, m)
        if actuation["release"] == 0 or m == 0:
            return m, rank
        constraint_forces(c, m, rank)
        worst = -actuation["release_force"]
        drop = NO_ROW
        for i in range(m):
            row = work["row"][i]
            if row < STOP_ROW and row % 2 == 0 and work["force"][i] < worst:
                worst = work["force"][i]
                drop = row // 2
        if drop == NO_ROW:
            return m, rank
        tick["active"][drop] = 0
