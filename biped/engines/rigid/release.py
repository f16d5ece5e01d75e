"""Contacts release when the ground would have to pull: which of the touching constraints go on acting."""

from __future__ import annotations

from biped.base.jit import kernel
from biped.engines.rigid.gauss import change, unilateral
from biped.engines.rigid.motion import active_rows, evaluate, land
from biped.engines.rigid.tree import point_row

APART = 1e-9
"""Relative acceleration away from a constraint, or relative pull, that is only rounding."""


@kernel
def release(w, q, v):
    """Lets go what the ground or a stop would have to pull, then evaluates the motion that remains.

    All touching constraints are solved with signs; those that the solution accelerates apart are released, normal and
    tangential row together. A point that would fall straight back without its tangential row (friction alone lifts
    it) is held for the rest of the step.
    """
    evaluate(w, q, v)
    dropped = False
    for _ in range(8):
        if not pulled(w):
            break
        m = active_rows(w)
        # The signed problem starts from the equalities' solution: y₀ = C⁺d, and y₀ = Cᵀλ.
        for j in range(9):
            s = 0.0
            for i in range(m):
                s += w["C"][i, j] * w["multiplier"][i]
            w["y"][j] = s
        unilateral(w, m)
        change(w, m, w["x"])  # R⁻¹(y - y₀) accelerates apart
        for j in range(9):
            s = w["y"][j]
            w["r"][j] = -s
            for i in range(m):
                w["r"][j] += w["C"][i, j] * w["multiplier"][i]
        size = 0.0
        for j in range(9):
            size = max(size, abs(w["y"][j]))
        found = False
        for i in range(m):
            if not w["signed"][i]:
                continue
            apart = 0.0
            for j in range(9):
                apart += w["C"][i, j] * w["r"][j]
            which = w["row"][i] // 2 if w["row"][i] < 8 else w["row"][i] - 4
            if apart > APART * size:
                w["active"][which] = 0
                w["releases"] += 1
                found = True
        if not found:
            # Redundant rows: the shortest multipliers pull although others, without a pull, give the same motion.
            for i in range(m):
                w["lam"][w["row"][i]] = w["multiplier"][i]
            for i in range(6):
                w["held"][i] = w["active"][i]
            break
        dropped = True
        evaluate(w, q, v)
    if dropped and _hold_falling(w, q):
        evaluate(w, q, v)


@kernel
def multiplier_row(i):
    """The unilateral row of constraint i: a point's normal, or a knee."""
    return 2 * i if i < 4 else 4 + i


@kernel
def pulled(w):
    """Whether a constraint that may let go has a multiplier of the wrong sign."""
    largest = 0.0
    for row in range(10):
        largest = max(largest, abs(w["lam"][row]))
    for i in range(6):
        if w["active"][i] and not w["held"][i] and w["lam"][multiplier_row(i)] < -APART * largest:
            return True
    return False


@kernel
def _hold_falling(w, q):
    """Holds points at zero gap and gap rate whose acceleration is into the ground; returns whether there are any."""
    found = False
    for i in range(4):
        if w["active"][i] or abs(w["gap"][i]) > 1e-9 or abs(w["gap_rate"][i]) > 1e-9:
            continue
        point_row(w, i, 0, w["r"])
        s = w["point_bias"][i, 1]
        for j in range(9):
            s += w["r"][j] * w["v_dot"][j]
        if s < -1e-6:
            land(w, i, q)
            w["held"][i] = 1
            found = True
    return found
