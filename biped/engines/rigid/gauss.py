"""Gauss's principle of least constraint, with equalities (3.6)-(3.7) and with inequalities (3.5).

In the metric of M = RᵀR, with C = A R⁻¹: the constrained change y = R Δ of an acceleration or a velocity is the
shortest y with C y = d, or with C y >= d in the rows of unilateral constraints. The first is y = C⁺d. The second is

    y = Cᵀλ,   λ = argmin ‖Cᵀλ - y₀‖,  λ >= 0 in unilateral rows,   C y₀ = d

a least-squares problem with signs, solved exactly and in finitely many steps by Lawson and Hanson's active sets
(Solving Least Squares Problems, 1974, ch. 23); rows of bilateral constraints are always in the active set. λ are the
forces, or the impulses. Redundant rows cost nothing: y is unique, and λ the shortest of those that belong to it.
"""

from __future__ import annotations

from biped.base.jit import kernel
from biped.control.constraints import back_through_R
from biped.numerics.factor import (
    factor_rows,
    factor_tall,
    least_squares,
    reflect,
    reflect_back,
    solve_transposed,
    transposed_minimum_norm,
)

RANK = 1e-10
"""Relative size below which a row of C is dependent: between rounding and what a real force would need (thesis.md)."""

MOST = 40
"""Most exchanges of the active-set solution: 6 unilateral rows need a handful; rounding must not make it endless."""


@kernel
def weigh_rows(w, m):
    """Fills C = A R⁻¹ (m, 9)."""
    A, C, R = w["A"], w["C"], w["R"]
    for i in range(m):
        for j in range(9):
            C[i, j] = A[i, j]
        solve_transposed(R, C[i])


@kernel
def factor_all(w, m):
    """Factors C (m, 9) into F; returns the rank."""
    F, C = w["F"], w["C"]
    for i in range(m):
        for j in range(9):
            F[i, j] = C[i, j]
    return factor_rows(F, m, 9, RANK, w["tau"], w["pivot"])


@kernel
def shortest(w, m, rank):
    """Leaves y = C⁺d (9,) for the d (m,) of the record and the factors of `factor_all`."""
    z, y = w["z"], w["y"]
    least_squares(w["F"], m, rank, w["pivot"], w["L"], w["tau2"], w["d"], z)
    for j in range(9):
        y[j] = z[j] if j < rank else 0.0
    reflect_back(w["F"], rank, 9, w["tau"], y)


@kernel
def multipliers(w, m, rank):
    """Leaves the shortest λ (m,) with Cᵀλ = C⁺d in `multiplier`, after `shortest`."""
    transposed_minimum_norm(w["F"], m, rank, w["pivot"], w["L"], w["tau2"], w["z"], w["multiplier"])


@kernel
def _least_squares_in(w, count):
    """Writes the λ of min ‖Cᵀλ - y₀‖ over the `count` chosen rows into `solved`, in the order chosen."""
    F, C, x = w["F"], w["C"], w["x"]
    for i in range(count):
        for j in range(9):
            F[i, j] = C[w["chosen"][i], j]
    rank = factor_rows(F, count, 9, RANK, w["tau"], w["pivot"])
    for j in range(9):
        x[j] = w["y"][j]
    reflect(F, rank, 9, w["tau"], x)
    for i in range(rank):
        w["z"][i] = x[i]
    if rank < count:
        factor_tall(F, count, rank, w["L"], w["tau2"])
    transposed_minimum_norm(F, count, rank, w["pivot"], w["L"], w["tau2"], w["z"], w["solved"])


@kernel
def _choose(w, m):
    count = 0
    for i in range(m):
        if w["passive"][i]:
            w["chosen"][count] = i
            count += 1
    return count


@kernel
def unilateral(w, m):
    """Minimises ‖Cᵀλ - y₀‖ with λ >= 0 in the signed rows, for the y₀ in `y`; leaves λ in `multiplier`.

    Args:
        w: Record with C (m, 9), which rows are `signed`, and y₀ in `y`.
        m: Number of rows.
    """
    lam, solved, passive, signed, C, y, r = (
        w["multiplier"], w["solved"], w["passive"], w["signed"], w["C"], w["y"], w["r"],
    )  # fmt: skip
    for i in range(m):
        lam[i] = 0.0
        passive[i] = 1 - signed[i]
    newest = -1
    for _ in range(MOST):
        # The best λ in the passive rows; a step towards it ends where the first sign would turn.
        while True:
            count = _choose(w, m)
            _least_squares_in(w, count)
            step, leaving = 1.0, -1
            for c in range(count):
                i = w["chosen"][c]
                if signed[i] and solved[c] <= 0.0:
                    ratio = lam[i] / (lam[i] - solved[c]) if lam[i] > solved[c] else 0.0
                    if ratio < step or leaving < 0:
                        step, leaving = ratio, i
            for c in range(count):
                i = w["chosen"][c]
                lam[i] += step * (solved[c] - lam[i])
            if leaving < 0:
                break
            lam[leaving] = 0.0
            passive[leaving] = 0
        # The row that the residual violates most joins; none is violated at the solution.
        for j in range(9):
            r[j] = y[j]
        size = 0.0
        for j in range(9):
            for i in range(m):
                r[j] -= C[i, j] * lam[i]
            size += y[j] * y[j]
        worst, joining = 1e-26 * size, -1
        for i in range(m):
            if passive[i] or i == newest:
                continue
            s, length = 0.0, 0.0
            for j in range(9):
                s += C[i, j] * r[j]
                length += C[i, j] * C[i, j]
            if s > 0.0 and s * s > worst * length:
                worst, joining = s * s / length, i
        if joining < 0:
            return
        passive[joining] = 1
        # A row that rounding throws out at once would join again for ever.
        count = _choose(w, m)
        _least_squares_in(w, count)
        newest = -1
        for c in range(count):
            if w["chosen"][c] == joining and solved[c] <= 0.0:
                passive[joining] = 0
                newest = joining


@kernel
def change(w, m, out):
    """Writes Δ = R⁻¹Cᵀλ (9,) for the λ in `multiplier` into out."""
    for j in range(9):
        s = 0.0
        for i in range(m):
            s += w["C"][i, j] * w["multiplier"][i]
        out[j] = s
    back_through_R(w["R"], out)
