"""Which constraints go on: the ground and the stops never pull, and a point slides where its place would need a pull.

With unlimited friction there is a case without a solution: a point that pulls as long as it keeps its place along the
ground, and falls straight back without touching it, because friction alone would lift it. Such a point slides: it
touches, keeps no place, and is pushed along the normal alone, which is a force that any friction allows. It comes to
rest, by an impact, at the first step that needs no pull for that.
"""

from biped.base.jit import kernel
from biped.engines.rigid.gauss import bias_on, change, other_end, row_on, stop_sliding, unilateral
from biped.engines.rigid.motion import evaluate, evaluate_again, impact, land, place, prepare
from biped.robot.planar.topology import N_CONSTRAINTS, N_POINTS, N_ROWS, NQ, STOP_ROW

APART = 1e-9
"""Relative acceleration away from a constraint, or relative pull, that is only rounding."""
TOUCH = 1e-9
"""[m, rad] within which a gap is closed."""


@kernel
def release(w, q, v):
    """Lets go what the ground or a stop would have to pull, then evaluates the motion that remains.

    All touching constraints are solved with signs; those that the solution accelerates apart are released, normal and
    tangential row together. A point that would fall straight back slides instead.
    """
    if w["state"]["known"]:
        evaluate_again(w, q, v)
    else:
        evaluate(w, q, v)
    for turn in range(N_POINTS + 1):
        if not (_let_go(w, q, v) and _slide_falling(w, q, turn == N_POINTS)):
            break
        evaluate(w, q, v)


@kernel
def _let_go(w, q, v):
    """Releases what would pull until nothing does; returns whether that was anything."""
    system, work, contact = w["system"], w["work"], w["contact"]
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
    return dropped


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
def _slide_falling(w, q, last):
    """Lets points at zero gap and gap rate slide whose acceleration is into the ground; returns whether there are any.

    The last time that it is asked in a step it also holds them, so that they do not leave and return without end.
    """
    contact, system, work = w["contact"], w["system"], w["work"]
    found = False
    for i in range(N_POINTS):
        if contact["active"][i] or abs(system["gap"][i]) > TOUCH or abs(system["gap_rate"][i]) > TOUCH:
            continue
        row_on(w, i, 0, work["r"])
        s = bias_on(w, i, 0)
        for j in range(NQ):
            s += work["r"][j] * w["motion"]["v_dot"][j]
        if s < -1e-6:
            land(w, i, q)
            contact["held"][i] = last
            contact["slides"][i] = contact["slides"][other_end(i)] = 1
            found = True
    return found


@kernel
def come_to_rest(w, q, v):
    """Brings points that slide to rest, by an impact, where they can keep their places without a pull.

    One that has slid off the end of its piece of the ground is released; one that has slid against a rise is stopped.
    """
    contact = w["contact"]
    sliding = 0
    for i in range(N_POINTS):
        if contact["active"][i] and contact["slides"][i]:
            sliding |= 1 << i
    if sliding == 0:
        return
    place(w, q, v)
    for i in range(N_POINTS):
        if sliding >> i & 1:
            above = stop_sliding(w, i, q)
            contact["active"][i] = above <= TOUCH
            contact["held"][i] = above < -TOUCH
    w["state"]["known"] = 0
    release(w, q, v)
    for i in range(N_POINTS):
        if sliding >> i & 1 and contact["active"][i] and not contact["slides"][i]:
            impact(w, q, v)
            return
