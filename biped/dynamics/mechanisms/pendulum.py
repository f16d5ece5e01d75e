"""The mathematical pendulum of Figs 2.1 and 2.2: a point mass on a circle, q = (x, y)."""

import numpy as np

from biped.dynamics.system import ConstrainedSystem

GRAVITY = 9.81
LENGTH = 1.0
MASS = 1.0

CONSISTENT = (np.array([1.0, 0.0]), np.array([0.0, 0.0]))
"""q, v of the horizontal rest position."""
INCONSISTENT = (np.array([1.0 + 1e-5, 1e-5]), np.array([1e-4, -1e-4]))
"""q, v of Fig 2.1's imperfect start."""


def _mass(t, q, v, p, M):
    M[0, 0] = M[1, 1] = p[0]


def _force(t, q, v, p, Q):
    Q[1] = -p[0] * p[2]


def _phi(t, q, v, p, phi):
    phi[0] = q[0] ** 2 + q[1] ** 2 - p[1] ** 2


def _A(t, q, v, p, A):
    A[0, 0] = 2.0 * q[0]
    A[0, 1] = 2.0 * q[1]


def _b_v(t, q, v, p, b_v):
    b_v[0] = -2.0 * (v[0] ** 2 + v[1] ** 2)


def _potential(t, q, v, p):
    return p[0] * p[2] * q[1]


def pendulum(mass: float = MASS, length: float = LENGTH, gravity: float = GRAVITY) -> ConstrainedSystem:
    """Φ = x² + y² − l² [m²]."""
    return ConstrainedSystem(
        n=2,
        m=1,
        mass=_mass,
        force=_force,
        phi=_phi,
        A=_A,
        b_v=_b_v,
        potential=_potential,
        params=(mass, length, gravity),
        name="pendulum",
    )


def _angle_mass(t, q, v, p, M):
    M[0, 0] = p[0] * p[1] ** 2


def _angle_force(t, q, v, p, Q):
    Q[0] = -p[0] * p[2] * p[1] * np.cos(q[0])


def trusted(mass: float = MASS, length: float = LENGTH, gravity: float = GRAVITY) -> ConstrainedSystem:
    """The same pendulum in its angle from the horizontal, without constraints."""
    return ConstrainedSystem(
        n=1,
        m=0,
        mass=_angle_mass,
        force=_angle_force,
        params=(mass, length, gravity),
        name="pendulum (angle)",
    )


def position(angle: np.ndarray, length: float = LENGTH) -> np.ndarray:
    """(K, 2) position of the mass at angles (K,) from the horizontal [rad]."""
    return length * np.stack((np.cos(angle), np.sin(angle)), axis=1)


def exact(t: np.ndarray, length: float = LENGTH, gravity: float = GRAVITY) -> np.ndarray:
    """(K, 2) position at times t (K,), released at rest from the horizontal: a Jacobi elliptic function.

    With φ the angle from the lowest point and k = sin(π/4), sin(φ/2) = k·sn(K + ωt) = k·cd(ωt).
    """
    k = np.sqrt(0.5)
    _, cn, dn = jacobi(np.sqrt(gravity / length) * t, k)
    half = k * cn / dn  # sin(φ/2); cos(φ/2) = √(1 − k²)/dn
    other = np.sqrt(1.0 - k * k) / dn
    return length * np.stack((2.0 * half * other, half * half - other * other), axis=1)


def jacobi(u: np.ndarray, k: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Elliptic functions sn, cn, dn of u (K,) with modulus 0 < k < 1, by descending Gauss transformation."""
    a, b, c = [1.0], np.sqrt(1.0 - k * k), [k]
    while abs(c[-1]) > 1e-15:
        c.append(0.5 * (a[-1] - b))
        a_next = 0.5 * (a[-1] + b)
        b = np.sqrt(a[-1] * b)
        a.append(a_next)
    # Whole periods (π in the amplitude's own scale) are dropped first: u is large, its sine must not be.
    turns = np.remainder(u, 2.0 * np.pi / a[-1])
    phase = 2.0 ** (len(a) - 1) * a[-1] * turns
    for i in range(len(a) - 1, 0, -1):
        phase = 0.5 * (phase + np.arcsin(c[i] / a[i] * np.sin(phase)))
    sn, cn = np.sin(phase), np.cos(phase)
    dn = np.sqrt(1.0 - (k * sn) ** 2)
    return sn, cn, dn
