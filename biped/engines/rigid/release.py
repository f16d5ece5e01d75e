"""Contacts release when the ground would have to pull: which of the touching constraints go on acting."""

from biped.base.jit import kernel
from biped.engines.rigid.gauss import change, unilateral
from biped.engines.rigid.ground import bias_on, row_on
from biped.engines.rigid.motion import evaluate, evaluate_again, land, prepare
from biped.robot.planar.topology import N_CONSTRAINTS, N_POINTS, N_ROWS, NQ, STOP_ROW

APART = 1e-9
"""Relative acceleration away from a constraint, or relative pull, that is only rounding."""


@kernel
def release(w, q, v):
    """Lets go what the ground or a stop would have to pull, then evaluates the motion that remains.

    All touching constraints are solved with signs; those that the solution accelerates apart are released, normal and
    tangential row together. A point that would fall straight back without its tangential row (friction alone lifts
    it) is held for the rest of the step.
    """
    system, work, contact = w["system"], w["work"], w["contact"]
    if w["state"]["known"]:
        evaluate_again(w, q, v)
    else:
        evaluate(w, q, v)
    dropped = False
    for _ in range(8):
        if not pulled(w):
            break
        m = prepare(w)
        for i in range(m):
            work["multiplier"][i] = w["motion"]["lam"][system["row"][i]]
        # The signed problem starts from the equalities' solution: y₀ = C⁺d, and y₀ = Cᵀλ.
        for j in range(NQ):
            s = 0.0
            for i in range(m):
                s += system["C"][i, j] * work["multiplier"][i]
            work["y"][j] = s
        unilateral(w, m)
        change(w, m, work["x"])  # R⁻¹(y - y₀) accelerates apart
        for j in range(NQ):
            s = work["y"][j]
            work["r"][j] = -s
            for i in range(m):
                work["r"][j] += system["C"][i, j] * work["multiplier"][i]
        size = 0.0
        for j in range(NQ):
            size = max(size, abs(work["y"][j]))
        found = False
        for i in range(m):
            if not system["signed"][i]:
                continue
            apart = 0.0
            for j in range(NQ):
                apart += system["C"][i, j] * work["r"][j]
            row = system["row"][i]
            which = row // 2 if row < STOP_ROW else row - STOP_ROW + N_POINTS
            if apart > APART * size:
                contact["active"][which] = 0
                w["ledger"]["releases"] += 1
                found = True
        if not found:
            # Redundant rows: the shortest multipliers pull although others, without a pull, give the same motion.
            for i in range(m):
                w["motion"]["lam"][system["row"][i]] = work["multiplier"][i]
            for i in range(N_CONSTRAINTS):
                contact["held"][i] = contact["active"][i]
            break
        dropped = True
        evaluate(w, q, v)
    if dropped and _hold_falling(w, q):
        evaluate(w, q, v)


@kernel
def multiplier_row(i):
    """The unilateral row of constraint i: a point's normal, or a knee."""
    return 2 * i if i < N_POINTS else STOP_ROW + i - N_POINTS


@kernel
def pulled(w):
    """Whether a constraint that may let go has a multiplier of the wrong sign."""
    motion, contact = w["motion"], w["contact"]
    largest = 0.0
    for row in range(N_ROWS):
        largest = max(largest, abs(motion["lam"][row]))
    for i in range(N_CONSTRAINTS):
        if contact["active"][i] and not contact["held"][i] and motion["lam"][multiplier_row(i)] < -APART * largest:
            return True
    return False


@kernel
def _hold_falling(w, q):
    """Holds points at zero gap and gap rate whose acceleration is into the ground; returns whether there are any."""
    contact, system, work = w["contact"], w["system"], w["work"]
    found = False
    for i in range(N_POINTS):
        if contact["active"][i] or abs(system["gap"][i]) > 1e-9 or abs(system["gap_rate"][i]) > 1e-9:
            continue
        row_on(w, i, 0, work["r"])
        s = bias_on(w, i, 0)
        for j in range(NQ):
            s += work["r"][j] * w["motion"]["v_dot"][j]
        if s < -1e-6:
            land(w, i, q)
            contact["held"][i] = 1
            found = True
    return found
