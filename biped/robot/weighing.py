"""Rows of constraints in the metric of the mass matrix, a row in each lane, from a factor that begins at the feet.

M = LᵀL with L lower keeps the zeros between the legs, which meet only in the torso; C = A L⁻¹ keeps those of a foot's
rows. A perturbed M need not be positive: pivots are floored, far below any physical one.
"""

from __future__ import annotations

import math

from biped.base.jit import kernel
from biped.numerics.lanes import added, everywhere, load, store, times
from biped.robot.topology import HIP, NQ, NU, X

_FLOOR = 1e-10
"""Smallest square of a pivot, by the biped's mass."""


@kernel
def coupled(i, j):
    """Whether coordinates i > j are on one chain: the legs meet only in the torso."""
    return not (j >= HIP[0] and j < HIP[1] and i >= HIP[1])


@kernel
def factor_from_feet(M, spring, L):
    """Writes the lower L of M + diag(0, spring) = LᵀL; entries between the legs are zero and stay unwritten.

    Args:
        M: (9, 9), upper triangle.
        spring: (6,) added to the joints' diagonal entries.
        L: (9, 9) result.
    """
    floor = _FLOOR * M[X, X]
    for i in range(NQ - 1, -1, -1):
        s = M[i, i]
        if i >= NQ - NU:
            s += spring[i - (NQ - NU)]
        for k in range(i + 1, NQ):
            if coupled(k, i):
                s -= L[k, i] * L[k, i]
        L[i, i] = math.sqrt(max(s, floor))
        inverse = 1.0 / L[i, i]
        for j in range(i):
            if coupled(i, j):
                s = M[j, i]
                for k in range(i + 1, NQ):
                    if coupled(k, i) and coupled(k, j):
                        s -= L[k, i] * L[k, j]
                L[i, j] = s * inverse


@kernel
def factor_torso(M, S):
    """Writes the lower S (3, 3) of M_bb = SᵀS, of the torso's coordinates with rigid joints."""
    floor = _FLOOR * M[X, X]
    S[2, 2] = math.sqrt(max(M[2, 2], floor))
    S[2, 1] = M[1, 2] / S[2, 2]
    S[2, 0] = M[0, 2] / S[2, 2]
    S[1, 1] = math.sqrt(max(M[1, 1] - S[2, 1] * S[2, 1], floor))
    S[1, 0] = (M[0, 1] - S[2, 1] * S[2, 0]) / S[1, 1]
    S[0, 0] = math.sqrt(max(M[0, 0] - S[2, 0] * S[2, 0] - S[1, 0] * S[1, 0], floor))


@kernel
def weigh_torso(S, D):
    """Replaces the torso's part of rows D (3, lanes) by D S⁻¹."""
    z = times(everywhere(1.0 / S[2, 2]), load(D, 2))
    y = times(everywhere(1.0 / S[1, 1]), added(load(D, 1), -S[2, 1], z))
    x = times(everywhere(1.0 / S[0, 0]), added(added(load(D, 0), -S[2, 0], z), -S[1, 0], y))
    store(D, 0, x)
    store(D, 1, y)
    store(D, 2, z)


@kernel
def weigh(A, L, C):
    """Fills C = A L⁻¹, row by lane; a lane that is not a row but forces becomes L⁻ᵀ of them.

    Args:
        A: (9, lanes), coordinate by coordinate.
        L: (9, 9) of `factor_from_feet`.
        C: (9, lanes) result.
    """
    for j in range(NQ):
        store(C, j, load(A, j))
    for i in range(NQ - 1, -1, -1):
        x = times(everywhere(1.0 / L[i, i]), load(C, i))
        store(C, i, x)
        for j in range(i):
            if coupled(i, j):
                store(C, j, added(load(C, j), -L[i, j], x))
