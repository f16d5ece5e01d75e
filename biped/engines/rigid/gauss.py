"""Gauss's principle of least constraint, with equalities (3.6)-(3.7) and inequalities (3.5), and the ground's rows.

In the metric of M = RᵀR, with C = A R⁻¹: the constrained change y = R Δ of an acceleration or a velocity is the
shortest y with C y = d, or with C y >= d in the rows of unilateral constraints. The first is y = C⁺d. The second is

    y = Cᵀλ,   λ = argmin ‖Cᵀλ - y₀‖,  λ >= 0 in unilateral rows,   C y₀ = d

a least-squares problem with signs, solved exactly and in finitely many steps by Lawson and Hanson's active sets
(Solving Least Squares Problems, 1974, ch. 23); rows of bilateral constraints are always in the active set. λ are the
forces, or the impulses. Redundant rows cost nothing: y is unique, and λ the shortest of those that belong to it.

A point that touches is held in its place, whatever the ground's direction: that only says which force would be a pull.
The direction is the one of the piece on which the point landed until it lets go. A point that swings into a ramp from
the front lands on it as anywhere else: a plastic impact, no slip; the foot has stumbled. Without tiles or steps every
function here is the level one.
"""

import math

from biped.base.jit import kernel
from biped.numerics.factor import (
    factor_rows,
    factor_tall,
    least_squares,
    reflect,
    reflect_back,
    solve_upper,
    transposed_minimum_norm,
)
from biped.robot.ground import height_below, piece_below, rise_of
from biped.robot.planar.kinematics import point_row
from biped.robot.planar.topology import CHAINS, LINK_DOF, NQ, POINT_LEG, STOP_ROW, TOE, X

RANK = 1e-10
"""Relative size below which a row of C is dependent: between rounding and what a real force would need."""

MOST = 40
"""Most exchanges of the active-set solution: 6 unilateral rows need a handful; rounding must not make it endless."""


@kernel
def factor_all(w, m):
    """Factors C (m, 9) into F; returns the rank."""
    work = w["work"]
    F, C = work["F"], w["system"]["C"]
    for i in range(m):
        for j in range(NQ):
            F[i, j] = C[i, j]
    return factor_rows(F, m, NQ, RANK, work["tau"], work["pivot"])


@kernel
def shortest(w, m, rank):
    """Leaves y = C⁺d (9,) for the d (m,) of the record and the factors of `factor_all`."""
    work = w["work"]
    z, y = work["z"], work["y"]
    least_squares(work["F"], m, rank, work["pivot"], work["L"], work["tau2"], work["d"], z)
    for j in range(NQ):
        y[j] = z[j] if j < rank else 0.0
    reflect_back(work["F"], rank, NQ, work["tau"], y)


@kernel
def multipliers(w, m, rank):
    """Leaves the shortest λ (m,) with Cᵀλ = C⁺d in `multiplier`, after `shortest`."""
    work = w["work"]
    transposed_minimum_norm(
        work["F"],
        m,
        rank,
        work["pivot"],
        work["L"],
        work["tau2"],
        work["z"],
        work["multiplier"],
    )


@kernel
def _least_squares_in(w, count):
    """Writes the λ of min ‖Cᵀλ - y₀‖ over the `count` chosen rows into `solved`, in the order chosen."""
    work = w["work"]
    F, C, x = work["F"], w["system"]["C"], work["x"]
    for i in range(count):
        for j in range(NQ):
            F[i, j] = C[work["chosen"][i], j]
    rank = factor_rows(F, count, NQ, RANK, work["tau"], work["pivot"])
    for j in range(NQ):
        x[j] = work["y"][j]
    reflect(F, rank, NQ, work["tau"], x)
    for i in range(rank):
        work["z"][i] = x[i]
    if rank < count:
        factor_tall(F, count, rank, work["L"], work["tau2"])
    transposed_minimum_norm(F, count, rank, work["pivot"], work["L"], work["tau2"], work["z"], work["solved"])


@kernel
def _choose(w, m):
    work = w["work"]
    count = 0
    for i in range(m):
        if work["passive"][i]:
            work["chosen"][count] = i
            count += 1
    return count


@kernel
def unilateral(w, m):
    """Minimises ‖Cᵀλ - y₀‖ with λ >= 0 in the signed rows, for the y₀ in `y`; leaves λ in `multiplier`.

    Args:
        w: Record with C (m, 9), which rows are `signed`, and y₀ in `y`.
        m: Number of rows.
    """
    work, system = w["work"], w["system"]
    lam, solved, passive, signed, C, y, r = (
        work["multiplier"], work["solved"], work["passive"], system["signed"], system["C"], work["y"], work["r"],
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
                i = work["chosen"][c]
                if signed[i] and solved[c] <= 0.0:
                    ratio = lam[i] / (lam[i] - solved[c]) if lam[i] > solved[c] else 0.0
                    if ratio < step or leaving < 0:
                        step, leaving = ratio, i
            for c in range(count):
                i = work["chosen"][c]
                lam[i] += step * (solved[c] - lam[i])
            if leaving < 0:
                break
            lam[leaving] = 0.0
            passive[leaving] = 0
        # The row that the residual violates most joins; none is violated at the solution.
        for j in range(NQ):
            r[j] = y[j]
        size = 0.0
        for j in range(NQ):
            for i in range(m):
                r[j] -= C[i, j] * lam[i]
            size += y[j] * y[j]
        worst, joining = 1e-26 * size, -1
        for i in range(m):
            if passive[i] or i == newest:
                continue
            s, length = 0.0, 0.0
            for j in range(NQ):
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
            if work["chosen"][c] == joining and solved[c] <= 0.0:
                passive[joining] = 0
                newest = joining


@kernel
def change(w, m, out):
    """Writes Δ = R⁻¹Cᵀλ (9,) for the λ in `multiplier` into out."""
    system = w["system"]
    for j in range(NQ):
        s = 0.0
        for i in range(m):
            s += system["C"][i, j] * w["work"]["multiplier"][i]
        out[j] = s
    solve_upper(system["R"], out)


@kernel
def stand_on(w, i, q, v):
    """Point i's gap [m] and its rate, taken above z = 0, become those straight down to the ground."""
    ground, contact, system, at = w["ground"], w["contact"], w["system"], w["at"]
    x, speed = q[X] + at["point"][i, 0], v[X]  # velocities of places are those before an impact
    for k in CHAINS[POINT_LEG[i]]:
        speed += (at["joint"][k, 1] - at["point"][i, 1]) * v[k + LINK_DOF]
    if contact["active"][i]:
        rise = contact["sin"][i] / contact["cos"][i]
        height = contact["landed"][i] + rise * (x - contact["anchor"][i])
    else:
        k = piece_below(ground, x)
        rise = rise_of(ground, k)
        height = ground["z"][max(k, 0)] + rise * (x - ground["x"][max(k, 0)])
        contact["cos"][i] = 1.0 / math.sqrt(1.0 + rise * rise)
        contact["sin"][i] = rise * contact["cos"][i]
    system["gap"][i] -= height
    system["gap_rate"][i] -= rise * speed


@kernel
def stop_sliding(w, i, q):
    """Point i, which slides, is to keep the place where it is now, on the piece of the ground on which it landed.

    Returns:
        How far [m] that piece, or what goes on from it, is above the ground there: 0 but beyond its end.
    """
    contact = w["contact"]
    x, before = q[X] + w["at"]["point"][i, 0], contact["anchor"][i]
    contact["slides"][i], contact["anchor"][i] = 0, x
    if w["ground"]["count"] == 0:
        return 0.0
    contact["landed"][i] += contact["sin"][i] / contact["cos"][i] * (x - before)
    return contact["landed"][i] - height_below(w["ground"], x)


@kernel
def off_ground(w, q, i, direction):
    """How far [m] a point that touches is from where it landed: along the normal (0) or along the ground (1)."""
    contact, gap = w["contact"], w["system"]["gap"][i]
    c, s = contact["cos"][i], contact["sin"][i]
    if direction == 0:
        return gap * c
    return (q[X] + w["at"]["point"][i, 0] - contact["anchor"][i]) / c + s * gap


@kernel
def keeps_place(contact, i):
    """Whether a point that touches has a row along the ground: one that slides has none.

    A flat foot has one such row, the heel's: the toe's says the same, except that its rounding, in an impact that lifts
    the toe, would be enforced with forces beyond measure.
    """
    return not (contact["slides"][i] or (i in TOE and contact["active"][other_end(i)]))


@kernel
def other_end(i):
    """The toe of a foot's heel, the heel of its toe."""
    return i ^ 1


@kernel
def row_on(w, i, direction, out):
    """Writes a point's row (9,) of A along the ground's normal (0), or along the ground (1)."""
    point_row(w["at"], i, direction, out)
    if w["ground"]["count"] == 0:
        return
    other = w["contact"]["other"]
    point_row(w["at"], i, 1 - direction, other)
    c, s = w["contact"]["cos"][i], w["contact"]["sin"][i]
    if direction == 0:
        s = -s
    for j in range(NQ):
        out[j] = c * out[j] + s * other[j]


@kernel
def bias_on(w, i, direction):
    """J̇v [m/s²] of that row."""
    bias = w["at"]["point_bias"]
    if w["ground"]["count"] == 0:
        return bias[i, 1 - direction]
    c, s = w["contact"]["cos"][i], w["contact"]["sin"][i]
    return c * bias[i, 1] - s * bias[i, 0] if direction == 0 else c * bias[i, 0] + s * bias[i, 1]


@kernel
def add_impulse(w, row, size):
    """Adds a row's impulse [N s, N m s] to the tick's, which are normal and along the slope, whatever stands on it."""
    impulse = w["ledger"]["impulse"]
    if w["ground"]["count"] == 0 or row >= STOP_ROW:
        impulse[row] += size
        return
    i = row // 2
    c, s = w["contact"]["cos"][i], w["contact"]["sin"][i]
    if row % 2 == 0:
        impulse[2 * i] += c * size
        impulse[2 * i + 1] -= s * size
    else:
        impulse[2 * i] += s * size
        impulse[2 * i + 1] += c * size
