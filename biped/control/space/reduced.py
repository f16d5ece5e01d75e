"""The walker as its contacts feel it: rows of A weighed by the mass matrix, by blocks, a direction in each lane.

With M (and what is added to the joints) = RᵀR, eliminated from the feet, C = R⁻ᵀAᵀ needs a 6 × 6 factor of each leg and
one of the base with the joints above; what two directions do to each other is the product of their columns, and
directions of different legs meet in the base and in joints that both hang on: no others are ever moved by a sole. A
foot's four points have twelve directions: the lanes.
"""

from biped.base.jit import kernel
from biped.control.space.record import DIRECTIONS, LEG, LEG_POINTS, LEGS
from biped.numerics.factor import cholesky
from biped.numerics.lanes import LANES, added, everywhere, load, store, times

STOPS = LEGS * LANES
"""First row of the products that is not a point's direction but a joint's stop; the forces on all follow the stops."""


@kernel
def factor(c, soft):
    """Factors M, with `soft` added to the diagonals of driven joints, by blocks; divisions are done once."""
    at, work = c["at"], c["work"]
    S = work["R_base"]
    upper, reach, trunk = S.shape[0], work["W"].shape[2], soft.size - LEGS * LEG
    first = upper - reach
    for i in range(upper):
        for j in range(upper):
            S[i, j] = at["M_base"][i, j]
    for i in range(trunk):
        S[i, i] += soft[i]
    for leg in range(LEGS):
        R, W = work["R_leg"][leg], work["W"][leg]
        for i in range(LEG):
            for j in range(LEG):
                R[i, j] = at["M_leg"][leg, i, j]
            R[i, i] += soft[trunk + LEG * leg + i]
        cholesky(R, R)
        for i in range(LEG):
            R[i, i] = 1.0 / R[i, i]
            for j in range(reach):
                s = at["M_cross"][leg, i, j]
                for k in range(i):
                    s -= R[k, i] * W[k, j]
                W[i, j] = s * R[i, i]
        for i in range(reach):
            for j in range(i, reach):
                s = S[first + i, first + j]
                for k in range(LEG):
                    s -= W[k, i] * W[k, j]
                S[first + i, first + j] = s
    cholesky(S, S)
    for i in range(upper):
        S[i, i] = 1.0 / S[i, i]


@kernel
def _weigh_leg(R, first, x):
    """Replaces a leg's part of x, which begins at `first`, by R⁻ᵀ times it."""
    for i in range(LEG):
        s = x[first + i]
        for k in range(i):
            s -= R[k, i] * x[first + k]
        x[first + i] = s * R[i, i]


@kernel
def weigh_forces(c, x):
    """Replaces forces x, in the law's order, by R⁻ᵀx."""
    work = c["work"]
    S = work["R_base"]
    upper, reach = S.shape[0], work["W"].shape[2]
    first = upper - reach
    for leg in range(LEGS):
        _weigh_leg(work["R_leg"][leg], upper + LEG * leg, x)
    for i in range(upper):
        s = x[i]
        if i >= first:
            for leg in range(LEGS):
                for k in range(LEG):
                    s -= work["W"][leg, k, i - first] * x[upper + LEG * leg + k]
        for k in range(i):
            s -= S[k, i] * x[k]
        x[i] = s * S[i, i]


@kernel
def weigh_stops(c):
    """Fills the weighed columns of the stops, each of which pushes one joint one way; nothing in the other leg."""
    work, belief = c["work"], c["belief"]
    S = work["R_base"]
    reach = work["W"].shape[2]
    first = S.shape[0] - reach
    for one in range(work["stop"].shape[0]):
        leg, joint = belief["stop_leg"][one], belief["stop_joint"][one]
        x, R, W = work["stop"][one], work["R_leg"][leg], work["W"][leg]
        for i in range(LEG):
            s = belief["stop_way"][one] if i == joint else 0.0
            for k in range(joint, i):
                s -= R[k, i] * x[reach + k]
            x[reach + i] = s * R[i, i] if i >= joint else 0.0
        for i in range(reach):
            s = 0.0
            for k in range(joint, LEG):
                s -= W[k, i] * x[reach + k]
            for k in range(i):
                s -= S[first + k, first + i] * x[k]
            x[i] = s * S[first + i, first + i]


@kernel
def weigh_points(c):
    """Fills C = R⁻ᵀAᵀ of the legs that have points near the ground."""
    A, work = c["at"]["A"], c["work"]
    C, S = work["C"], work["R_base"]
    reach = work["W"].shape[2]
    first = S.shape[0] - reach
    for leg in range(LEGS):
        if not work["standing"][leg]:
            continue
        R, W = work["R_leg"][leg], work["W"][leg]
        for i in range(LEG):
            x = load(A, LEGS * (reach + i) + leg)
            for k in range(i):
                x = added(x, -R[k, i], load(C, LEGS * (reach + k) + leg))
            store(C, LEGS * (reach + i) + leg, times(everywhere(R[i, i]), x))
        for i in range(reach):
            x = load(A, LEGS * i + leg)
            for k in range(LEG):
                x = added(x, -W[k, i], load(C, LEGS * (reach + k) + leg))
            for k in range(i):
                x = added(x, -S[first + k, first + i], load(C, LEGS * k + leg))
            store(C, LEGS * i + leg, times(everywhere(S[first + i, first + i]), x))


@kernel
def products(c, x):
    """Fills D: what a push in the direction of a row does in the direction of each lane.

    Rows are the directions of the points near the ground, then the stops, then the weighed forces x.
    """
    work, of_leg = c["work"], c["belief"]["stop_leg"]
    C, D, near, standing = work["C"], work["D"], work["near"], work["standing"]
    upper, reach, stops = work["R_base"].shape[0], work["W"].shape[2], work["stop"].shape[0]
    first = upper - reach
    for other in range(LEGS):
        if not standing[other]:
            continue
        for leg in range(other, LEGS):  # the products of right and left are those of left and right
            for lane in range(LANES):
                if not near[LEG_POINTS * leg + lane // DIRECTIONS]:
                    continue
                mine = LANES * leg + lane
                s = everywhere(0.0)
                for i in range(reach):
                    s = added(s, C[i, mine], load(C, LEGS * i + other))
                if leg == other:
                    for i in range(reach, reach + LEG):
                        s = added(s, C[i, mine], load(C, LEGS * i + other))
                store(D, LEGS * mine + other, s)
        for one in range(stops):
            s = everywhere(0.0)
            for i in range(reach):
                s = added(s, work["stop"][one, i], load(C, LEGS * i + other))
            if of_leg[one] == other:
                for i in range(reach, reach + LEG):
                    s = added(s, work["stop"][one, i], load(C, LEGS * i + other))
            store(D, LEGS * (STOPS + one) + other, s)
        s = everywhere(0.0)
        for i in range(reach):
            s = added(s, x[first + i], load(C, LEGS * i + other))
        for i in range(LEG):
            s = added(s, x[upper + LEG * other + i], load(C, LEGS * (reach + i) + other))
        store(D, LEGS * (STOPS + stops) + other, s)


@kernel
def motion(c, x):
    """Replaces weighed forces x by what they do, R⁻¹x."""
    work = c["work"]
    S = work["R_base"]
    upper, reach = S.shape[0], work["W"].shape[2]
    lead = upper - reach
    for i in range(upper - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, upper):
            s -= S[i, k] * x[k]
        x[i] = s * S[i, i]
    for leg in range(LEGS):
        first = upper + LEG * leg
        R, W = work["R_leg"][leg], work["W"][leg]
        for i in range(LEG - 1, -1, -1):
            s = x[first + i]
            for k in range(reach):
                s -= W[i, k] * x[lead + k]
            for k in range(i + 1, LEG):
                s -= R[i, k] * x[first + k]
            x[first + i] = s * R[i, i]
