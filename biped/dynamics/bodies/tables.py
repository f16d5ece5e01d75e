"""Six functions through which the solver sees a mechanism of bodies; they read one array of parameters.

M is constant and every row of Φ quadratic, so that Φ, A and b_v share one table of (row, j, k, factor), each
standing for factor · qⱼ qₖ, with 1 instead of a coordinate −1. The functions know no mechanism: they are compiled
once for all. p starts with where its tables start: M, Φ, steady forces, springs, spans of springs, torques, and
where the last one ends.
"""

import numpy as np

from biped.base.jit import kernel

TABLES = 6
WIDTHS = (3, 4, 3, 5, 3, 4)
"""Numbers of an entry: (i, j, M), (row, j, k, factor), (force, j, Q), (force, stiffness, rest, first and last entry
of its span), (component, j, factor), (force, first coordinate, torque, damping)."""


def pack(tables: list[list[tuple[float, ...]]]) -> np.ndarray:
    """The array of parameters, from the tables in the order of `WIDTHS`."""
    flat = [np.array(table, dtype=float).reshape(-1) for table in tables]
    starts = TABLES + 1 + np.concatenate(([0], np.cumsum([x.size for x in flat])))
    return np.concatenate((starts, *flat))


@kernel
def at(x, j):
    """x[j], or 1 in place −1."""
    return 1.0 if j < 0 else x[j]


@kernel
def stretch(x, p, spring, d):
    """Fill d with the vector along a spring and return its length; x = q."""
    d[:] = 0.0
    span = int(p[4])
    for e in range(int(p[spring + 3]), int(p[spring + 4])):
        i = span + 3 * e
        d[int(p[i])] += p[i + 2] * at(x, int(p[i + 1]))
    return np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])


def mass(t, q, v, p, M):
    """M, constant."""
    for i in range(int(p[0]), int(p[1]), 3):
        M[int(p[i]), int(p[i + 1])] += p[i + 2]


def phi(t, q, v, p, out):
    """Φ."""
    for i in range(int(p[1]), int(p[2]), 4):
        out[int(p[i])] += p[i + 3] * at(q, int(p[i + 1])) * at(q, int(p[i + 2]))


def A(t, q, v, p, out):
    """∂Φ/∂q."""
    for i in range(int(p[1]), int(p[2]), 4):
        row, j, k = int(p[i]), int(p[i + 1]), int(p[i + 2])
        if j >= 0:
            out[row, j] += p[i + 3] * q[k]
        if k >= 0:
            out[row, k] += p[i + 3] * at(q, j)


def b_v(t, q, v, p, out):
    """−Ȧ v."""
    for i in range(int(p[1]), int(p[2]), 4):
        j, k = int(p[i + 1]), int(p[i + 2])
        if j >= 0:
            out[int(p[i])] -= 2.0 * p[i + 3] * v[j] * v[k]


def force(t, q, v, p, Q):
    """Weight and pushes, springs, torques."""
    for i in range(int(p[2]), int(p[3]), 3):
        Q[int(p[i + 1])] += p[i + 2]
    d = np.zeros(3)
    for s in range(int(p[3]), int(p[4]), 5):
        length = stretch(q, p, s, d)
        if length > 0.0:  # else it pulls nowhere
            pull = -p[s + 1] * (length - p[s + 2]) / length
            for e in range(int(p[s + 3]), int(p[s + 4])):
                i = int(p[4]) + 3 * e
                if p[i + 1] >= 0.0:
                    Q[int(p[i + 1])] += pull * d[int(p[i])] * p[i + 2]
    for i in range(int(p[5]), int(p[6]), 4):
        c = int(p[i + 1]) + 2
        moment = p[i + 2] - p[i + 3] * (q[c] * v[c + 1] - q[c + 1] * v[c])
        Q[c] -= q[c + 1] * moment
        Q[c + 1] += q[c] * moment


def power(t, q, v, p, out):
    """Power of every force [W]."""
    for i in range(int(p[2]), int(p[3]), 3):
        out[int(p[i])] += p[i + 2] * v[int(p[i + 1])]
    d = np.zeros(3)
    for s in range(int(p[3]), int(p[4]), 5):
        length = stretch(q, p, s, d)
        if length > 0.0:
            pull = -p[s + 1] * (length - p[s + 2]) / length
            for e in range(int(p[s + 3]), int(p[s + 4])):
                i = int(p[4]) + 3 * e
                if p[i + 1] >= 0.0:
                    out[int(p[s])] += pull * d[int(p[i])] * p[i + 2] * v[int(p[i + 1])]
    for i in range(int(p[5]), int(p[6]), 4):
        c = int(p[i + 1]) + 2
        spin = q[c] * v[c + 1] - q[c + 1] * v[c]
        out[int(p[i])] += (p[i + 2] - p[i + 3] * spin) * spin


def potential(t, q, v, p):
    """Potential energy of the weight and the springs [J]."""
    energy = 0.0
    for i in range(int(p[2]), int(p[3]), 3):
        if p[i] == 0.0:  # the weight; a push has none
            energy -= p[i + 2] * q[int(p[i + 1])]
    d = np.zeros(3)
    for s in range(int(p[3]), int(p[4]), 5):
        energy += 0.5 * p[s + 1] * (stretch(q, p, s, d) - p[s + 2]) ** 2
    return energy
