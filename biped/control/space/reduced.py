"""The walker as its contacts feel it: rows of A weighed by the mass matrix, by blocks, a direction in each lane.

With M (and what is added to the joints) = RᵀR, eliminated from the feet, C = R⁻ᵀAᵀ needs a 6 × 6 factor of each leg and
one of the base; what two directions do to each other is the product of their columns, and directions of different legs
meet in the base only. A foot's four points have twelve directions: the lanes.
"""

from __future__ import annotations

from biped.base.jit import kernel
from biped.control.space.record import DIRECTIONS
from biped.control.space.topology import BASE, KNEE, LEG, LEG_POINTS, LEGS
from biped.numerics.lanes import LANES, added, everywhere, load, store, times
from biped.numerics.triangular import cholesky

STOPS = LEGS * LANES
"""First row of the products that is not a point's direction but a knee's stop."""
FORCES = STOPS + LEGS
"""Row of the products of the forces on all joints and the base."""


@kernel
def factor(c, soft):
    """Factors M, with `soft` (12,) added to the legs' diagonals, by blocks; divisions are done once."""
    at, work = c["at"], c["work"]
    S = work["R_base"]
    for i in range(BASE):
        for j in range(BASE):
            S[i, j] = at["M_base"][i, j]
    for leg in range(LEGS):
        R, W = work["R_leg"][leg], work["W"][leg]
        for i in range(LEG):
            for j in range(LEG):
                R[i, j] = at["M_leg"][leg, i, j]
            R[i, i] += soft[LEG * leg + i]
        cholesky(R, R)
        for i in range(LEG):
            R[i, i] = 1.0 / R[i, i]
            for j in range(BASE):
                s = at["M_cross"][leg, i, j]
                for k in range(i):
                    s -= R[k, i] * W[k, j]
                W[i, j] = s * R[i, i]
        for i in range(BASE):
            for j in range(i, BASE):
                s = S[i, j]
                for k in range(LEG):
                    s -= W[k, i] * W[k, j]
                S[i, j] = s
    cholesky(S, S)
    for i in range(BASE):
        S[i, i] = 1.0 / S[i, i]


@kernel
def _weigh_leg(R, leg, x):
    """Replaces the leg's part of x (18,) by R⁻ᵀ times it."""
    first = BASE + LEG * leg
    for i in range(LEG):
        s = x[first + i]
        for k in range(i):
            s -= R[k, i] * x[first + k]
        x[first + i] = s * R[i, i]


@kernel
def weigh_forces(c, x):
    """Replaces forces x (18,), base first, by R⁻ᵀx."""
    work = c["work"]
    for leg in range(LEGS):
        _weigh_leg(work["R_leg"][leg], leg, x)
    for i in range(BASE):
        s = x[i]
        for leg in range(LEGS):
            for k in range(LEG):
                s -= work["W"][leg, k, i] * x[BASE + LEG * leg + k]
        for k in range(i):
            s -= work["R_base"][k, i] * x[k]
        x[i] = s * work["R_base"][i, i]


@kernel
def weigh_stops(c):
    """Fills the weighed columns of the knees' stops, which push knees to bend; nothing in the other leg."""
    work = c["work"]
    for leg in range(LEGS):
        x, R, W = work["stop"][leg], work["R_leg"][leg], work["W"][leg]
        for i in range(LEG):
            s = -1.0 if i == KNEE else 0.0
            for k in range(KNEE, i):
                s -= R[k, i] * x[BASE + k]
            x[BASE + i] = s * R[i, i] if i >= KNEE else 0.0
        for i in range(BASE):
            s = 0.0
            for k in range(KNEE, LEG):
                s -= W[k, i] * x[BASE + k]
            for k in range(i):
                s -= work["R_base"][k, i] * x[k]
            x[i] = s * work["R_base"][i, i]


@kernel
def weigh_points(c):
    """Fills C = R⁻ᵀAᵀ of the legs that have points near the ground."""
    A, work = c["at"]["A"], c["work"]
    C, S = work["C"], work["R_base"]
    for leg in range(LEGS):
        if not work["standing"][leg]:
            continue
        R, W = work["R_leg"][leg], work["W"][leg]
        for i in range(LEG):
            x = load(A, LEGS * (BASE + i) + leg)
            for k in range(i):
                x = added(x, -R[k, i], load(C, LEGS * (BASE + k) + leg))
            store(C, LEGS * (BASE + i) + leg, times(everywhere(R[i, i]), x))
        for i in range(BASE):
            x = load(A, LEGS * i + leg)
            for k in range(LEG):
                x = added(x, -W[k, i], load(C, LEGS * (BASE + k) + leg))
            for k in range(i):
                x = added(x, -S[k, i], load(C, LEGS * k + leg))
            store(C, LEGS * i + leg, times(everywhere(S[i, i]), x))


@kernel
def products(c, x):
    """Fills D: what a push in the direction of a row does in the direction of each lane.

    Rows are the directions of the points near the ground, then the stops, then the weighed forces x (18,).
    """
    work = c["work"]
    C, D, near, standing = work["C"], work["D"], work["near"], work["standing"]
    for other in range(LEGS):
        if not standing[other]:
            continue
        for leg in range(other, LEGS):  # the products of right and left are those of left and right
            for lane in range(LANES):
                if not near[LEG_POINTS * leg + lane // DIRECTIONS]:
                    continue
                mine = LANES * leg + lane
                s = everywhere(0.0)
                for i in range(BASE):
                    s = added(s, C[i, mine], load(C, LEGS * i + other))
                if leg == other:
                    for i in range(BASE, BASE + LEG):
                        s = added(s, C[i, mine], load(C, LEGS * i + other))
                store(D, LEGS * mine + other, s)
        for leg in range(LEGS):
            s = everywhere(0.0)
            for i in range(BASE):
                s = added(s, work["stop"][leg, i], load(C, LEGS * i + other))
            if leg == other:
                for i in range(BASE, BASE + LEG):
                    s = added(s, work["stop"][leg, i], load(C, LEGS * i + other))
            store(D, LEGS * (STOPS + leg) + other, s)
        s = everywhere(0.0)
        for i in range(BASE):
            s = added(s, x[i], load(C, LEGS * i + other))
        for i in range(BASE, BASE + LEG):
            s = added(s, x[LEG * other + i], load(C, LEGS * i + other))
        store(D, LEGS * FORCES + other, s)


@kernel
def motion(c, x):
    """Replaces weighed forces x (18,) by what they do, R⁻¹x."""
    work = c["work"]
    S = work["R_base"]
    for i in range(BASE - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, BASE):
            s -= S[i, k] * x[k]
        x[i] = s * S[i, i]
    for leg in range(LEGS):
        first = BASE + LEG * leg
        R, W = work["R_leg"][leg], work["W"][leg]
        for i in range(LEG - 1, -1, -1):
            s = x[first + i]
            for k in range(BASE):
                s -= W[i, k] * x[k]
            for k in range(i + 1, LEG):
                s -= R[i, k] * x[first + k]
            x[first + i] = s * R[i, i]
