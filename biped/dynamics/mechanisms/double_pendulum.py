"""Two point masses on two rods of 1 m, q = (x₁, y₁, x₂, y₂): with one of them light, constraints that nearly depend."""

import numpy as np

from biped.dynamics.system import ConstrainedSystem

GRAVITY = 9.81

START = (np.array([1.0, 0.0, 2.0, 0.0]), np.zeros(4))
"""q, v stretched out to the right, at rest."""


def _mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = p[0]
    M[2, 2] = M[3, 3] = p[1]


def _force(t, q, v, p, Q):
    Q[1] = -p[2] * p[0]
    Q[3] = -p[2] * p[1]


def _phi(t, q, v, p, out):
    out[0] = q[0] ** 2 + q[1] ** 2 - 1.0
    out[1] = (q[2] - q[0]) ** 2 + (q[3] - q[1]) ** 2 - 1.0


def _A(t, q, v, p, out):
    for d in range(2):
        out[0, d] = 2.0 * q[d]
        out[1, d] = -2.0 * (q[2 + d] - q[d])
        out[1, 2 + d] = 2.0 * (q[2 + d] - q[d])


def _b_v(t, q, v, p, out):
    out[0] = -2.0 * (v[0] ** 2 + v[1] ** 2)
    out[1] = -2.0 * ((v[2] - v[0]) ** 2 + (v[3] - v[1]) ** 2)


def _potential(t, q, v, p):
    return p[2] * (p[0] * q[1] + p[1] * q[3])


def double_pendulum(first: float = 1.0, second: float = 1.0) -> ConstrainedSystem:
    """Masses [kg] from the support outwards; Φ in m²."""
    return ConstrainedSystem(
        n=4,
        m=2,
        mass=_mass,
        force=_force,
        phi=_phi,
        A=_A,
        b_v=_b_v,
        potential=_potential,
        params=(first, second, GRAVITY),
        name="double pendulum",
    )


def _angle_mass(t, q, v, p, M):
    M[0, 0], M[1, 1] = p[0] + p[1], p[1]
    M[0, 1] = M[1, 0] = p[1] * np.cos(q[0] - q[1])


def _angle_force(t, q, v, p, Q):
    s = p[1] * np.sin(q[0] - q[1])
    Q[0] = -s * v[1] ** 2 - (p[0] + p[1]) * p[2] * np.cos(q[0])
    Q[1] = s * v[0] ** 2 - p[1] * p[2] * np.cos(q[1])


def trusted(first: float = 1.0, second: float = 1.0) -> ConstrainedSystem:
    """The same pendulum in the rods' angles from the horizontal, without constraints; `START` is zero."""
    return ConstrainedSystem(
        n=2,
        m=0,
        mass=_angle_mass,
        force=_angle_force,
        params=(first, second, GRAVITY),
        name="double pendulum (angles)",
    )


def position(angles: np.ndarray) -> np.ndarray:
    """(K, 4) places of both masses at angles (K, 2) [rad]."""
    first = np.stack((np.cos(angles[:, 0]), np.sin(angles[:, 0])), axis=1)
    return np.hstack((first, first + np.stack((np.cos(angles[:, 1]), np.sin(angles[:, 1])), axis=1)))
