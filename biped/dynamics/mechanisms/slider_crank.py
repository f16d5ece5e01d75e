"""The slider-crank of Figs 2.3 and 2.4: two equal rods and a slider, q = (x₁, y₁, θ₁, θ₂).

The support point (x₁, y₁) is free until the constraints hold it. With equal rods the mechanism is singular
whenever they are vertical: the slider passes under the support, where the crank could turn without it.
Table values: the thesis gives l = 1 m, m = m_s = 1 kg, the torque and the damper; slender rods, I = ml²/12.
"""

import numpy as np

from biped.dynamics.system import ConstrainedSystem

LENGTH = 1.0  # [m] of each rod
MASS = 1.0  # [kg] of each rod
SLIDER = 1.0  # [kg]
GRAVITY = 9.81  # [m/s²]
TORQUE = 20.0  # [N m] on the crank, counter-clockwise
DAMPING = 5.0  # [N m s] on the crank

CONSISTENT = (np.zeros(4), np.zeros(4))
"""q, v stretched out to the right, at rest."""
INCONSISTENT = (np.array([1e-3, 1e-2, 1e-3, 1e-2]), np.array([1e-3, 1e-2, 1e-3, 1e-2]))
"""q, v of Fig 2.3's imperfect start."""


def _mass(t, q, v, p, M):
    l, m, slider = p[0], p[1], p[2]
    inertia = m * l * l / 12.0
    c1, s1, c2, s2 = np.cos(q[2]), np.sin(q[2]), np.cos(q[3]), np.sin(q[3])
    M[0, 0] = M[1, 1] = 2.0 * m + slider
    M[0, 2] = M[2, 0] = -(1.5 * m + slider) * l * s1
    M[1, 2] = M[2, 1] = (1.5 * m + slider) * l * c1
    M[0, 3] = M[3, 0] = -(0.5 * m + slider) * l * s2
    M[1, 3] = M[3, 1] = (0.5 * m + slider) * l * c2
    M[2, 2] = (1.25 * m + slider) * l * l + inertia
    M[3, 3] = (0.25 * m + slider) * l * l + inertia
    M[2, 3] = M[3, 2] = (0.5 * m + slider) * l * l * (c1 * c2 + s1 * s2)


def _force(t, q, v, p, Q):
    l, m, slider, g = p[0], p[1], p[2], p[3]
    c1, s1, c2, s2 = np.cos(q[2]), np.sin(q[2]), np.cos(q[3]), np.sin(q[3])
    first, second = (1.5 * m + slider) * l, (0.5 * m + slider) * l
    spin1, spin2 = v[2] * v[2], v[3] * v[3]
    Q[0] = first * c1 * spin1 + second * c2 * spin2
    Q[1] = first * s1 * spin1 + second * s2 * spin2 - (2.0 * m + slider) * g
    coupling = second * l * (s1 * c2 - c1 * s2)
    Q[2] = -coupling * spin2 - first * g * c1 + p[4] - p[5] * v[2]
    Q[3] = coupling * spin1 - second * g * c2


def _phi(t, q, v, p, phi):
    phi[0] = q[0]
    phi[1] = q[1]
    phi[2] = q[1] + p[0] * (np.sin(q[2]) + np.sin(q[3]))


def _A(t, q, v, p, A):
    A[0, 0] = A[1, 1] = A[2, 1] = 1.0
    A[2, 2] = p[0] * np.cos(q[2])
    A[2, 3] = p[0] * np.cos(q[3])


def _b_v(t, q, v, p, b_v):
    b_v[2] = p[0] * (np.sin(q[2]) * v[2] ** 2 + np.sin(q[3]) * v[3] ** 2)


def slider_crank(
    length: float = LENGTH,
    mass: float = MASS,
    slider: float = SLIDER,
    gravity: float = GRAVITY,
    torque: float = TORQUE,
    damping: float = DAMPING,
) -> ConstrainedSystem:
    """Φ = (x₁, y₁, y₁ + l(sin θ₁ + sin θ₂)) [m]."""
    return ConstrainedSystem(
        n=4,
        m=3,
        mass=_mass,
        force=_force,
        phi=_phi,
        A=_A,
        b_v=_b_v,
        params=(length, mass, slider, gravity, torque, damping),
        name="slider-crank",
    )


def _angle_mass(t, q, v, p, M):
    l, m, slider = p[0], p[1], p[2]
    s, c = np.sin(q[0]), np.cos(q[0])
    M[0, 0] = l * l * (m * (0.25 + 1.0 / 6.0 + 2.25 * s * s + 0.25 * c * c) + 4.0 * slider * s * s)


def _angle_force(t, q, v, p, Q):
    l, m, slider, g = p[0], p[1], p[2], p[3]
    s, c = np.sin(q[0]), np.cos(q[0])
    Q[0] = -l * l * (2.0 * m + 4.0 * slider) * s * c * v[0] ** 2 - m * g * l * c + p[4] - p[5] * v[0]


def trusted(params=(LENGTH, MASS, SLIDER, GRAVITY, TORQUE, DAMPING)) -> ConstrainedSystem:
    """The same mechanism in the crank's angle alone: θ₁ = θ, θ₂ = −θ; started at q = v = 0."""
    return ConstrainedSystem(n=1, m=0, mass=_angle_mass, force=_angle_force, params=params, name="slider-crank (angle)")


def slider_position(q: np.ndarray, length: float = LENGTH) -> np.ndarray:
    """(K,) x of the slider in the states q (K, 4), or (K, 1) for the trusted solution [m]."""
    if q.shape[1] == 1:
        return 2.0 * length * np.cos(q[:, 0])
    return q[:, 0] + length * (np.cos(q[:, 2]) + np.cos(q[:, 3]))
