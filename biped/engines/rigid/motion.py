"""The motion under the active constraints: accelerations by (3.6)-(3.7), free of drift as in chapter II, and impacts.

Constraint i < 4 is a point of a foot: its height is its gap, and while it is active it also keeps its place along the
ground. Constraints 4 and 5 are the knees: their gap is the angle to the stop.
"""

from __future__ import annotations

from biped.base.jit import kernel
from biped.control.constraints import back_through_R
from biped.engines.rigid.gauss import change, factor_all, multipliers, shortest, unilateral, weigh_rows
from biped.engines.rigid.tree import applied_forces, mass_and_bias, place, point_row
from biped.numerics.factor import cholesky, solve_transposed

PARTING = 1e-9
"""Relative velocity away from a constraint below which it is still touching; rounding is 1e-12."""


@kernel
def active_rows(w):
    """Fills A (m, 9), b_v = -J̇v (m,), the rows' numbers and whether they are signed; returns m.

    Normals and knees are signed, unless they are held. A flat foot has one tangential row, the heel's: the toe's says
    the same, except that its rounding, in an impact that lifts the toe, would be enforced with forces beyond measure.
    """
    A, b_v, row, active, bias, signed = w["A"], w["b_v"], w["row"], w["active"], w["point_bias"], w["signed"]
    m = 0
    for i in range(4):
        if active[i]:
            for direction in range(2):
                if direction == 1 and i % 2 == 0 and active[i + 1]:
                    continue
                point_row(w, i, direction, A[m])
                b_v[m] = -bias[i, 1 - direction]
                row[m] = 2 * i + direction
                signed[m] = 1 if direction == 0 and not w["held"][i] else 0
                m += 1
    for leg in range(2):
        if active[4 + leg]:
            for j in range(9):
                A[m, j] = 0.0
            A[m, 4 + 3 * leg] = -1.0
            b_v[m] = 0.0
            row[m] = 8 + leg
            signed[m] = 1 - w["held"][4 + leg]
            m += 1
    return m


@kernel
def gaps(w, q, v):
    """Fills the six gaps [m, rad] and their rates for the configuration that `place` left."""
    gap, rate, point = w["gap"], w["gap_rate"], w["point"]
    for i in range(4):
        gap[i] = q[1] + point[i, 1]
        rate[i] = v[1]
        leg = i // 2
        for step in range(4):
            k = 0 if step == 0 else 3 * leg + step
            rate[i] += (point[i, 0] - w["joint"][k, 0]) * v[k + 2]
    for leg in range(2):
        gap[4 + leg] = -q[4 + 3 * leg]
        rate[4 + leg] = -v[4 + 3 * leg]


@kernel
def evaluate(w, q, v):
    """The constrained motion at (q, v) under the forces of the tick.

    Leaves q̇ = v + W(b_q - A v) with b_q = 0, v̇ = a + W(b_v - A a), W = R⁻¹C⁺, the multipliers by row, and the shift
    -WΦ that takes the configuration back onto its constraints.
    """
    place(w, q, v)
    mass_and_bias(w)
    applied_forces(w, v)
    gaps(w, q, v)
    cholesky(w["M"], w["R"])
    R, f, d, lam = w["R"], w["f"], w["d"], w["lam"]
    power = 0.0
    for j in range(9):
        power += w["force"][j] * v[j]
        f[j] = w["force"][j] - w["h"][j]
    w["power"] = power
    solve_transposed(R, f)
    for i in range(10):
        lam[i] = 0.0
    m = active_rows(w)
    v_dot, q_dot, shift, y = w["v_dot"], w["q_dot"], w["shift"], w["y"]
    for j in range(9):
        v_dot[j], q_dot[j], shift[j] = f[j], v[j], 0.0
    if m > 0:
        weigh_rows(w, m)
        rank = factor_all(w, m)
        for i in range(m):
            s = w["b_v"][i]
            for j in range(9):
                s -= w["C"][i, j] * f[j]
            d[i] = s
        shortest(w, m, rank)
        multipliers(w, m, rank)
        for i in range(m):
            lam[w["row"][i]] = w["multiplier"][i]
        for j in range(9):
            v_dot[j] += y[j]
        for i in range(m):
            s = 0.0
            for j in range(9):
                s -= w["A"][i, j] * v[j]
            d[i] = s
        _corrected(w, m, rank, q_dot)
        for i in range(m):
            d[i] = -residual(w, q, w["row"][i])
        _corrected(w, m, rank, shift)
    back_through_R(R, v_dot)


@kernel
def residual(w, q, row):
    """Φ of a row [m, rad]: height, place along the ground minus where it landed, angle to the knee stop."""
    if row >= 8:
        return w["gap"][row - 4]
    i = row // 2
    return w["gap"][i] if row % 2 == 0 else q[0] + w["point"][i, 0] - w["anchor"][i]


@kernel
def _corrected(w, m, rank, out):
    """Adds W d to out."""
    shortest(w, m, rank)
    back_through_R(w["R"], w["y"])
    for j in range(9):
        out[j] += w["y"][j]


@kernel
def land(w, i, q):
    """Makes constraint i active; a point stays where it is now."""
    w["active"][i] = 1
    if i < 4:
        w["anchor"][i] = q[0] + w["point"][i, 0]


@kernel
def impact(w, q, v):
    """Plastic impact (3.5) of all active constraints; v becomes v⁺, constraints that part become inactive.

    Held constraints are bilateral. Adds the impulses to the tick's and the loss to the ledger.
    """
    place(w, q, v)
    mass_and_bias(w)
    cholesky(w["M"], w["R"])
    m = active_rows(w)
    weigh_rows(w, m)
    R, f, y, lam = w["R"], w["f"], w["y"], w["multiplier"]
    before = 0.0
    for i in range(9):
        s = 0.0
        for j in range(i, 9):
            s += R[i, j] * v[j]
        f[i] = s
        y[i] = -s
        before += s * s
    unilateral(w, m)
    change(w, m, w["x"])
    after = 0.0
    for i in range(9):
        s = f[i]
        for k in range(m):
            s += w["C"][k, i] * lam[k]
        after += s * s
    for j in range(9):
        v[j] += w["x"][j]
    for i in range(m):
        w["impulse"][w["row"][i]] += lam[i]
    loss = 0.5 * (before - after)
    w["loss"] += loss
    w["least_loss"] = min(w["least_loss"], loss)
    w["impacts"] += 1
    scale = 0.0
    for j in range(9):
        scale = max(scale, abs(v[j]))
    gaps(w, q, v)
    for i in range(6):
        if w["active"][i] and not w["held"][i] and w["gap_rate"][i] > PARTING * scale:
            w["active"][i] = 0
