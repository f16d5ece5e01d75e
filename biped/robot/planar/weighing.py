"""Rows of constraints in the metric of the mass matrix, a row in each lane, from a factor that begins at the feet.

M = LᵀL with L lower keeps the zeros between the legs, which meet only in the torso; C = A L⁻¹ keeps those of a foot's
rows. A perturbed M need not be positive: pivots are floored, far below any physical one.
"""

import math

from biped.base.jit import inner_kernel, kernel
from biped.numerics.lanes import added, everywhere, few, load, load_few, store, times
from biped.robot.planar.topology import BASE, HIP, NQ, X

_FLOOR = 1e-10
"""Smallest square of a pivot, by the biped's mass."""


@kernel
def coupled(i, j):
    """Whether coordinates i > j are on one chain: the legs meet only in the torso."""
    return not (j >= HIP[0] and j < HIP[1] and i >= HIP[1])


@inner_kernel
def _factor_leg(M, spring, L, hip, floor):
    """Writes the rows of L of the leg whose hip's coordinate is given."""
    knee, ankle = hip + 1, hip + 2
    L[ankle, ankle] = math.sqrt(max(M[ankle, ankle] + spring[ankle - BASE], floor))
    inverse = 1.0 / L[ankle, ankle]
    for j in range(BASE):
        L[ankle, j] = M[j, ankle] * inverse
    L[ankle, hip] = M[hip, ankle] * inverse
    L[ankle, knee] = M[knee, ankle] * inverse
    L[knee, knee] = math.sqrt(max((M[knee, knee] + spring[knee - BASE]) - L[ankle, knee] * L[ankle, knee], floor))
    inverse = 1.0 / L[knee, knee]
    for j in range(BASE):
        L[knee, j] = (M[j, knee] - L[ankle, knee] * L[ankle, j]) * inverse
    L[knee, hip] = (M[hip, knee] - L[ankle, knee] * L[ankle, hip]) * inverse
    s = ((M[hip, hip] + spring[hip - BASE]) - L[knee, hip] * L[knee, hip]) - L[ankle, hip] * L[ankle, hip]
    L[hip, hip] = math.sqrt(max(s, floor))
    inverse = 1.0 / L[hip, hip]
    for j in range(BASE):
        L[hip, j] = ((M[j, hip] - L[knee, hip] * L[knee, j]) - L[ankle, hip] * L[ankle, j]) * inverse


@kernel
def _left(M, L, i, j):
    """Returns entry (j, i) of M, of the torso's coordinates, less what those after i take away."""
    s = M[j, i]
    for k in range(i + 1, NQ):
        s -= L[k, i] * L[k, j]
    return s


@kernel
def factor_from_feet(M, spring, L):
    """Writes the lower L of M + diag(0, spring) = LᵀL; entries between the legs are zero and stay unwritten.

    Args:
        M: (9, 9), upper triangle.
        spring: (6,) added to the joints' diagonal entries.
        L: (9, 9) result.
    """
    floor = _FLOOR * M[X, X]
    _factor_leg(M, spring, L, HIP[1], floor)
    _factor_leg(M, spring, L, HIP[0], floor)
    L[2, 2] = math.sqrt(max(_left(M, L, 2, 2), floor))
    inverse = 1.0 / L[2, 2]
    L[2, 0] = _left(M, L, 2, 0) * inverse
    L[2, 1] = _left(M, L, 2, 1) * inverse
    L[1, 1] = math.sqrt(max(_left(M, L, 1, 1), floor))
    L[1, 0] = _left(M, L, 1, 0) * (1.0 / L[1, 1])
    L[0, 0] = math.sqrt(max(_left(M, L, 0, 0), floor))


@inner_kernel
def substitute_from_feet(L, x):
    """Overwrites x (9,) with L⁻¹ x, of the factor that begins at the feet."""
    for i in range(NQ):
        s = x[i]
        for j in range(i):
            if coupled(i, j):
                s -= L[i, j] * x[j]
        x[i] = s / L[i, i]


@inner_kernel
def factor_torso(M, S):
    """Writes the lower S (3, 3) of M_bb = SᵀS, of the torso's coordinates with rigid joints."""
    floor = _FLOOR * M[X, X]
    S[2, 2] = math.sqrt(max(M[2, 2], floor))
    S[2, 1] = M[1, 2] / S[2, 2]
    S[2, 0] = M[0, 2] / S[2, 2]
    S[1, 1] = math.sqrt(max(M[1, 1] - S[2, 1] * S[2, 1], floor))
    S[1, 0] = (M[0, 1] - S[2, 1] * S[2, 0]) / S[1, 1]
    S[0, 0] = math.sqrt(max(M[0, 0] - S[2, 0] * S[2, 0] - S[1, 0] * S[1, 0], floor))


@inner_kernel
def weigh_torso(S, D):
    """Replaces the torso's part of rows D (3, lanes) by D S⁻¹."""
    z = times(everywhere(1.0 / S[2, 2]), load(D, 2))
    y = times(everywhere(1.0 / S[1, 1]), added(load(D, 1), -S[2, 1], z))
    x = times(everywhere(1.0 / S[0, 0]), added(added(load(D, 0), -S[2, 0], z), -S[1, 0], y))
    store(D, 0, x)
    store(D, 1, y)
    store(D, 2, z)


@inner_kernel
def _weigh_leg(A, L, C, hip):
    """Fills the part of C = A L⁻¹ of the leg whose hip's coordinate is given."""
    knee, ankle = hip + 1, hip + 2
    z = times(everywhere(1.0 / L[ankle, ankle]), load(A, ankle))
    y = times(everywhere(1.0 / L[knee, knee]), added(load(A, knee), -L[ankle, knee], z))
    x = added(added(load(A, hip), -L[ankle, hip], z), -L[knee, hip], y)
    store(C, hip, times(everywhere(1.0 / L[hip, hip]), x))
    store(C, knee, y)
    store(C, ankle, z)


@kernel
def weigh(A, L, C):
    """Fills C = A L⁻¹, row by lane; a lane that is not a row but forces becomes L⁻ᵀ of them.

    Args:
        A: (9, lanes), coordinate by coordinate.
        L: (9, 9) of `factor_from_feet`.
        C: (9, lanes) result.
    """
    _weigh_leg(A, L, C, HIP[1])
    _weigh_leg(A, L, C, HIP[0])
    for j in range(BASE):
        x = load(A, j)
        for k in range(NQ - 1, BASE - 1, -1):
            x = added(x, -L[k, j], load(C, k))
        store(C, j, x)
    weigh_torso(L, C)


@kernel
def _unweigh_leg(L, X, hip, a, b, c):
    """Replaces the part of X (9, 4) of a leg by that of L⁻¹X, given the torso's."""
    knee, ankle = hip + 1, hip + 2
    x = added(added(added(load_few(X, hip), -L[hip, 0], a), -L[hip, 1], b), -L[hip, 2], c)
    x = times(few(1.0 / L[hip, hip]), x)
    y = added(added(added(load_few(X, knee), -L[knee, 0], a), -L[knee, 1], b), -L[knee, 2], c)
    y = times(few(1.0 / L[knee, knee]), added(y, -L[knee, hip], x))
    z = added(added(added(load_few(X, ankle), -L[ankle, 0], a), -L[ankle, 1], b), -L[ankle, 2], c)
    z = times(few(1.0 / L[ankle, ankle]), added(added(z, -L[ankle, hip], x), -L[ankle, knee], y))
    store(X, hip, x)
    store(X, knee, y)
    store(X, ankle, z)


@kernel
def unweigh(L, X):
    """Replaces the columns of X (9, 4) by L⁻¹X, L (9, 9) of `factor_from_feet`."""
    a = times(few(1.0 / L[0, 0]), load_few(X, 0))
    b = times(few(1.0 / L[1, 1]), added(load_few(X, 1), -L[1, 0], a))
    c = times(few(1.0 / L[2, 2]), added(added(load_few(X, 2), -L[2, 0], a), -L[2, 1], b))
    store(X, 0, a)
    store(X, 1, b)
    store(X, 2, c)
    _unweigh_leg(L, X, HIP[0], a, b, c)
    _unweigh_leg(L, X, HIP[1], a, b, c)
