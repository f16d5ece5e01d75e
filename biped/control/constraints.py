"""The constraints imposed on the robot: rows of A, their forces, and the release test that decides which ones count.

Read literally, (3.15) treats every row of A as bilateral, and Q_d then asks the ground to pull on toes and heels. The
release test keeps a row only "when imposed on the robot": a point whose normal force would have to pull harder than
`release_force` is not a constraint, and is dropped before the torques are computed.
"""

from __future__ import annotations

from biped.base.jit import kernel
from biped.control.bias import sensed_bias
from biped.numerics.factor import (
    cholesky,
    factor_rows,
    least_squares,
    solve_transposed,
    transposed_minimum_norm,
)

NO_ROW = -1


@kernel
def candidates(c, q):
    """Marks the points that touch and the knees that are at their stop: the constraints that may be imposed."""
    active = c["active"]
    for i in range(4):
        active[i] = 1 if c["height"][i] < c["contact_height"] else 0
    for leg in range(2):
        active[4 + leg] = 1 if -q[4 + 3 * leg] < c["knee_angle"] else 0


@kernel
def constraint_rows(c, J):
    """Builds A (m, 9) and b_v = -J̇v (m,) of the active constraints; returns m.

    Row 2i is a point's normal direction, row 2i + 1 its tangential one, rows 8 and 9 the knees. With
    `single_tangential`, a flat foot has one tangential row (the heel's): the toe's says the same thing.
    """
    A, b_v, row, active, position, joint, rate = (
        c["A"], c["b_v"], c["row"], c["active"], c["position"], c["joint"], c["rate"],
    )  # fmt: skip
    m = 0
    for i in range(4):
        if active[i] == 0:
            continue
        leg = i // 2
        x, z = position[i, 0], position[i, 1]
        # -J̇v: centripetal accelerations along the chain torso, thigh, shank, foot, point.
        normal, tangential = 0.0, 0.0
        for step in range(4):
            link = 0 if step == 0 else 3 * leg + step
            if step < 3:
                nx, nz = joint[3 * leg + step + 1, 0], joint[3 * leg + step + 1, 1]
            else:
                nx, nz = x, z
            w2 = rate[link] * rate[link]
            tangential += w2 * (nx - joint[link, 0])
            normal += w2 * (nz - joint[link, 1])
        alone = c["single_tangential"] == 0 or i % 2 == 1 or active[i + 1] == 0
        for direction in range(2):
            if direction == 1 and not alone:
                continue
            for j in range(9):
                A[m, j] = 0.0
            for j in range(6):
                dof = j if j < 3 else 3 * leg + j
                if direction == 0:
                    A[m, dof] = J[2, dof] - J[4, dof] * x
                else:
                    A[m, dof] = J[0, dof] + J[4, dof] * z
            b_v[m] = normal if direction == 0 else tangential
            row[m] = 2 * i + direction
            m += 1
    for leg in range(2):
        if active[4 + leg]:
            for j in range(9):
                A[m, j] = 0.0
            A[m, 4 + 3 * leg] = 1.0
            b_v[m] = 0.0
            row[m] = 8 + leg
            m += 1
    if c["perturbed"]:
        for i in range(m):
            perturb_row(c, A[i], c["row_factor"][row[i]])
    return m


@kernel
def perturb_row(c, a, factor):
    """Multiplies a row of A by `factor` elementwise in the thesis's absolute coordinates, where the row is defined.

    a·q̇ with joint rates = a'·(absolute rates): along a leg a' is the difference of neighbouring joint entries.
    """
    for leg in range(2):
        hip = 3 + 3 * leg
        shank, foot = a[hip + 1] - a[hip + 2], a[hip + 2]
        thigh = a[hip] - a[hip + 1]
        a[2] -= a[hip]
        foot *= factor[hip + 2]
        shank *= factor[hip + 1]
        thigh *= factor[hip]
        a[hip + 2] = foot
        a[hip + 1] = foot + shank
        a[hip] = foot + shank + thigh
    for j in range(3):
        a[j] *= factor[j]
    a[2] += a[3] + a[6]


@kernel
def believed_mass(c, M):
    """Cholesky factor R of the controller's mass matrix, M = RᵀR; elementwise wrong if the record says so."""
    if c["perturbed"] == 0:
        cholesky(M, c["R"])
        return
    perturbed_mass(M, c["mass_factor"], c["M"])
    cholesky(c["M"], c["R"])


@kernel
def perturbed_mass(M, factor, full):
    """Fills `full`: M multiplied elementwise by `factor` in the thesis's absolute coordinates, back in joint ones.

    Args:
        M: (9, 9) mass matrix, upper triangle.
        factor: (9, 9), upper triangle.
        full: (9, 9) result, both triangles.
    """
    for i in range(9):
        for j in range(9):
            full[i, j] = M[min(i, j), max(i, j)]
    for sweep in range(2):  # rows, then columns: joint -> absolute
        for i in range(9):
            line = full[i] if sweep == 0 else full[:, i]
            for hip in (3, 6):
                line[2] -= line[hip]
                line[hip] -= line[hip + 1]
                line[hip + 1] -= line[hip + 2]
    for i in range(9):
        for j in range(9):
            full[i, j] *= factor[min(i, j), max(i, j)]
    for sweep in range(2):
        for i in range(9):
            line = full[i] if sweep == 0 else full[:, i]
            for hip in (3, 6):
                line[hip + 1] += line[hip + 2]
                line[hip] += line[hip + 1]
                line[2] += line[hip]


@kernel
def factor_constraints(c, m):
    """Factors C = A R⁻¹ (m, 9) into the record; returns its rank."""
    C, A, R = c["C"], c["A"], c["R"]
    for i in range(m):
        for j in range(9):
            C[i, j] = A[i, j]
        solve_transposed(R, C[i])
    return factor_rows(C, m, 9, c["tolerance"], c["tau"], c["pivot"])


@kernel
def constraint_forces(c, m, rank):
    """Minimum-norm multipliers λ (m,) [N, N m] of the motion under Q_d, (3.6)-(3.7): λ = (CCᵀ)⁺(b_v - A a)."""
    d, z, x = c["d"], c["z"], c["a"]
    for j in range(9):
        x[j] = c["Q_d"][j] - c["h"][j]
    solve_transposed(c["R"], x)  # R a
    back_through_R(c["R"], x)  # a
    for i in range(m):
        s = c["b_v"][i]
        for j in range(9):
            s -= c["A"][i, j] * x[j]
        d[i] = s
    least_squares(c["C"], m, rank, c["pivot"], c["L"], c["tau2"], d, z)
    transposed_minimum_norm(c["C"], m, rank, c["pivot"], c["L"], c["tau2"], z, c["force"])


@kernel
def back_through_R(R, x):
    """Replaces x (n,) by R⁻¹x."""
    for i in range(R.shape[0] - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, R.shape[0]):
            s -= R[i, k] * x[k]
        x[i] = s / R[i, i]


@kernel
def imposed_constraints(c, J, q):
    """Leaves the factored constraints that are imposed on the robot in the record; returns (m, rank).

    Starting from the candidates, the point that would be pulled hardest is dropped until none is pulled harder than
    `release_force`; without the release test all candidates stay.
    """
    candidates(c, q)
    if c["release"]:
        sensed_bias(c)  # nothing else needs bias forces
    while True:
        m = constraint_rows(c, J)
        rank = factor_constraints(c, m)
        if c["release"] == 0 or m == 0:
            return m, rank
        constraint_forces(c, m, rank)
        worst = -c["release_force"]
        drop = NO_ROW
        for i in range(m):
            row = c["row"][i]
            if row < 8 and row % 2 == 0 and c["force"][i] < worst:
                worst = c["force"][i]
                drop = row // 2
        if drop == NO_ROW:
            return m, rank
        c["active"][drop] = 0
