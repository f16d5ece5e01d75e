"""The walker as its contacts feel it: rows of A weighed by the mass matrix, by blocks, a direction in each lane.

With M (and what is added to the joints) = RᵀR, eliminated from the feet, C = R⁻ᵀAᵀ needs a 6 × 6 factor of each leg and
one of the base; what two directions do to each other is the product of their columns, and directions of different legs
meet in the base only.
"""

from __future__ import annotations

from biped.base.jit import kernel
from biped.control.spatial.record import BLOCKS
from biped.control.spatial.topology import BASE, KNEE, LEG, LEGS
from biped.numerics.lanes import LANES, added, everywhere, load, store, times
from biped.numerics.triangular import cholesky

EXTRA = 2 * LANES
"""First lane of what is not a point's: the right knee's stop, then the forces on base and right leg."""
FORCES = 1
STOP_LANE = (EXTRA, EXTRA + LANES)
FORCE_LANE = (EXTRA + FORCES, EXTRA + LANES + FORCES)


@kernel
def factor(c, soft):
    """Factors M, with `soft` (12,) added to the legs' diagonals, by blocks."""
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
            for j in range(BASE):
                s = at["M_cross"][leg, i, j]
                for k in range(i):
                    s -= R[k, i] * W[k, j]
                W[i, j] = s / R[i, i]
        for i in range(BASE):
            for j in range(i, BASE):
                s = S[i, j]
                for k in range(LEG):
                    s -= W[k, i] * W[k, j]
                S[i, j] = s
    cholesky(S, S)


@kernel
def lay_stops(c):
    """Writes the knees' stops, which push knees to bend, into the lanes beside the points'."""
    A = c["at"]["A"]
    for leg in range(LEGS):
        for i in range(BASE + LEG):
            A[i, STOP_LANE[leg]] = 0.0
        A[BASE + KNEE, STOP_LANE[leg]] = -1.0


@kernel
def lay_forces(c, forces):
    """Writes forces (18,) into their lanes, those on the base beside the right leg's."""
    A = c["at"]["A"]
    for leg in range(LEGS):
        for i in range(BASE):
            A[i, FORCE_LANE[leg]] = forces[i] if leg == 0 else 0.0
        for i in range(LEG):
            A[BASE + i, FORCE_LANE[leg]] = forces[BASE + LEG * leg + i]


@kernel
def weigh(c, near):
    """Fills C = R⁻ᵀAᵀ, of the legs that have points near the ground, and of stops and forces."""
    A, work = c["at"]["A"], c["work"]
    C, S = work["C"], work["R_base"]
    for block in range(BLOCKS):
        leg = block % LEGS
        if block < LEGS and not near[leg]:
            continue
        R, W = work["R_leg"][leg], work["W"][leg]
        for i in range(LEG):
            x = load(A, BLOCKS * (BASE + i) + block)
            for k in range(i):
                x = added(x, -R[k, i], load(C, BLOCKS * (BASE + k) + block))
            store(C, BLOCKS * (BASE + i) + block, times(everywhere(1.0 / R[i, i]), x))
        for i in range(BASE):
            x = load(A, BLOCKS * i + block)
            for k in range(LEG):
                x = added(x, -W[k, i], load(C, BLOCKS * (BASE + k) + block))
            for k in range(i):
                x = added(x, -S[k, i], load(C, BLOCKS * k + block))
            store(C, BLOCKS * i + block, times(everywhere(1.0 / S[i, i]), x))


@kernel
def products(c, near):
    """Fills D: what a push in the direction of a row's lane does in the direction of each lane."""
    C, D = c["work"]["C"], c["work"]["D"]
    for leg in range(LEGS):
        for lane in range(LANES + 1):  # the points' directions and the stop
            if lane < LANES and not near[leg]:
                continue
            mine = LANES * leg + lane if lane < LANES else STOP_LANE[leg]
            row = LANES * leg + lane if lane < LANES else EXTRA + leg
            for block in range(BLOCKS):
                if block < LEGS and not near[block]:
                    continue
                s = everywhere(0.0)
                for i in range(BASE):
                    s = added(s, C[i, mine], load(C, BLOCKS * i + block))
                if block % LEGS == leg:
                    for i in range(BASE, BASE + LEG):
                        s = added(s, C[i, mine], load(C, BLOCKS * i + block))
                store(D, BLOCKS * row + block, s)


@kernel
def motion(c, z, x):
    """Solves R x = z: z (18,) weighed forces, base first; x (18,) what they do."""
    work = c["work"]
    S = work["R_base"]
    for i in range(BASE - 1, -1, -1):
        s = z[i]
        for k in range(i + 1, BASE):
            s -= S[i, k] * x[k]
        x[i] = s / S[i, i]
    for leg in range(LEGS):
        first = BASE + LEG * leg
        R, W = work["R_leg"][leg], work["W"][leg]
        for i in range(LEG - 1, -1, -1):
            s = z[first + i]
            for k in range(BASE):
                s -= W[i, k] * x[k]
            for k in range(i + 1, LEG):
                s -= R[i, k] * x[first + k]
            x[first + i] = s / R[i, i]
