"""Systems a user might write: a floating triangle of rods, a skate, a bead on a turning rod."""

import numpy as np

from biped.dynamics import ConstrainedSystem

# --- four masses on a triangle of rods and a tail, floating free: momentum is nobody's to change ---

RODS = np.array([[0, 1], [1, 2], [2, 0], [2, 3]])

FREE_Q = np.array([0.0, 0.0, 1.0, 0.0, 0.3, 0.8, 0.9, 1.6])

LENGTHS = np.array([np.hypot(*(FREE_Q[2 * i : 2 * i + 2] - FREE_Q[2 * j : 2 * j + 2])) for i, j in RODS])


def free_mass(t, q, v, p, M):
    for i in range(8):
        M[i, i] = p[i // 2]


def no_force(t, q, v, p, Q):
    pass


def rods_phi(t, q, v, p, phi):
    for k in range(4):
        i, j = 2 * RODS[k, 0], 2 * RODS[k, 1]
        phi[k] = (q[i] - q[j]) ** 2 + (q[i + 1] - q[j + 1]) ** 2 - LENGTHS[k] ** 2


def rods_A(t, q, v, p, A):
    for k in range(4):
        i, j = 2 * RODS[k, 0], 2 * RODS[k, 1]
        for d in range(2):
            A[k, i + d] = 2 * (q[i + d] - q[j + d])
            A[k, j + d] = -A[k, i + d]


def rods_b_v(t, q, v, p, b_v):
    for k in range(4):
        i, j = 2 * RODS[k, 0], 2 * RODS[k, 1]
        b_v[k] = -2 * ((v[i] - v[j]) ** 2 + (v[i + 1] - v[j + 1]) ** 2)


FREE = ConstrainedSystem(
    n=8,
    m=4,
    mass=free_mass,
    force=no_force,
    phi=rods_phi,
    A=rods_A,
    b_v=rods_b_v,
    params=(1.0, 2.0, 0.5, 5.0),
)


# --- a skate on a slope: a constraint on velocities alone, with an exact solution ---


def skate_mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = M[2, 2] = 1.0


def skate_force(t, q, v, p, Q):
    Q[0] = p[0]


def skate_A(t, q, v, p, A):
    A[0, 0], A[0, 1] = np.sin(q[2]), -np.cos(q[2])


def skate_b_v(t, q, v, p, b_v):
    b_v[0] = -v[2] * (np.cos(q[2]) * v[0] + np.sin(q[2]) * v[1])


# --- a bead on a rod that turns as told: a constraint on time, with an exact solution ---


def bead_mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = 1.0


def bead_phi(t, q, v, p, phi):
    phi[0] = q[1] * np.cos(t) - q[0] * np.sin(t)


def bead_A(t, q, v, p, A):
    A[0, 0], A[0, 1] = -np.sin(t), np.cos(t)


def bead_b_q(t, q, v, p, b_q):
    b_q[0] = q[1] * np.sin(t) + q[0] * np.cos(t)


def bead_b_v(t, q, v, p, b_v):
    b_v[0] = 2 * (v[1] * np.sin(t) + v[0] * np.cos(t)) + q[1] * np.cos(t) - q[0] * np.sin(t)


BEAD = ConstrainedSystem(
    n=2, m=1, mass=bead_mass, force=no_force, phi=bead_phi, A=bead_A, b_q=bead_b_q, b_v=bead_b_v, name="bead"
)

# --- where a pendulum starts ---

START = {"q": [1.0, 0.0], "v": [0.0, 0.0], "duration": 1.0, "dt": 1e-2}
