"""A leg that hangs from a hip held still: the bench of Figs 4.7 and 4.8, q = absolute angles of thigh, shank and foot.

Angles are counter-clockwise from the leg that hangs straight down with its foot level, so that the joint angles of the
thesis are φ1 = q1, φ2 = q2 − q1, φ3 = q3 − q2 (the torso upright). Joints have the actuator's reflected inertia,
viscous and Coulomb friction, and a spring-damper with a moving equilibrium; those that are locked are constraints.
"""

from typing import NamedTuple

import numpy as np

from biped.dynamics.system import ConstrainedSystem

LINKS = 3
STICKING = 0.01
"""[rad/s] Coulomb friction is τ tanh(rate / STICKING): a number that a Runge–Kutta scheme can follow."""


class HangingLeg(NamedTuple):
    """Lengths and masses, proximal link first; vectors (ahead, up) in the link's frame.

    Attributes:
        mass: (3,) [kg].
        inertia: (3,) [kg m²] about the centre of mass.
        com: (3, 2) [m] from the link's joint.
        joint: (3, 2) [m] of the joint at the link's end from its own; the foot's is without effect.
        armature: (3,) [kg m²] inertia of the actuators, reflected to hip, knee and ankle.
        damping: (3,) [N m s/rad].
        coulomb: (3,) [N m].
    """

    mass: np.ndarray
    inertia: np.ndarray
    com: np.ndarray
    joint: np.ndarray
    armature: np.ndarray
    damping: np.ndarray
    coulomb: np.ndarray


class MovingSprings(NamedTuple):
    """Torques −K (φ − φ_d) − B φ̇ of hip, knee and ankle, with φ_d = amplitude sin(frequency t + phase) + mean.

    Attributes:
        K: (3,) [N m/rad].
        B: (3,) [N m s/rad].
        amplitude: (3,) [rad].
        frequency: (3,) [rad/s].
        phase: (3,) [rad].
        mean: (3,) [rad].
    """

    K: np.ndarray
    B: np.ndarray
    amplitude: np.ndarray
    frequency: np.ndarray
    phase: np.ndarray
    mean: np.ndarray

    def reference(self, t: np.ndarray) -> np.ndarray:
        """(n, 3) [rad] φ_d at times (n,) [s]."""
        return self.amplitude * np.sin(self.frequency * t[:, None] + self.phase) + self.mean


NO_DRIVE = MovingSprings(*np.zeros((6, LINKS)))
"""Joints that swing freely."""

_MASS, _INERTIA, _COM, _JOINT, _ARMATURE, _DAMPING, _COULOMB = 0, 3, 6, 12, 18, 21, 24
_DRIVE, _GRAVITY, _LOCKED = 27, 45, 46


def _mass(t, q, v, p, M):
    for link in range(3):
        for i in range(link + 1):
            at_i = _COM + 2 * link if i == link else _JOINT + 2 * i
            for j in range(link + 1):
                at_j = _COM + 2 * link if j == link else _JOINT + 2 * j
                c, s = np.cos(q[i] - q[j]), np.sin(q[i] - q[j])
                along = p[at_i] * p[at_j] + p[at_i + 1] * p[at_j + 1]
                across = p[at_i] * p[at_j + 1] - p[at_i + 1] * p[at_j]
                M[i, j] += p[_MASS + link] * (c * along + s * across)
        M[link, link] += p[_INERTIA + link] + p[_ARMATURE + link]
        if link > 0:
            M[link - 1, link - 1] += p[_ARMATURE + link]
            M[link - 1, link] -= p[_ARMATURE + link]
            M[link, link - 1] -= p[_ARMATURE + link]


def _force(t, q, v, p, Q):
    for link in range(3):
        # Of the link's centre of mass: acceleration at zero q̈, less gravity.
        x, z = 0.0, p[_GRAVITY]
        for j in range(link + 1):
            at = _COM + 2 * link if j == link else _JOINT + 2 * j
            c, s = np.cos(q[j]), np.sin(q[j])
            x -= (c * p[at] - s * p[at + 1]) * v[j] * v[j]
            z -= (s * p[at] + c * p[at + 1]) * v[j] * v[j]
        for i in range(link + 1):
            at = _COM + 2 * link if i == link else _JOINT + 2 * i
            c, s = np.cos(q[i]), np.sin(q[i])
            Q[i] -= p[_MASS + link] * (x * (-s * p[at] - c * p[at + 1]) + z * (c * p[at] - s * p[at + 1]))
    for joint in range(3):
        angle, rate = q[joint], v[joint]
        if joint > 0:
            angle, rate = angle - q[joint - 1], rate - v[joint - 1]
        K, B, amplitude, frequency, phase, mean = p[_DRIVE + joint : _GRAVITY : 3]
        u = -K * (angle - amplitude * np.sin(frequency * t + phase) - mean) - B * rate
        u -= p[_DAMPING + joint] * rate + p[_COULOMB + joint] * np.tanh(rate / STICKING)
        Q[joint] += u
        if joint > 0:
            Q[joint - 1] -= u


def _phi(t, q, v, p, phi):
    for row in range(phi.size):
        joint, angle = int(p[_LOCKED + 2 * row]), p[_LOCKED + 2 * row + 1]
        phi[row] = q[joint] - angle
        if joint > 0:
            phi[row] -= q[joint - 1]


def _A(t, q, v, p, A):
    for row in range(A.shape[0]):
        joint = int(p[_LOCKED + 2 * row])
        A[row, joint] = 1.0
        if joint > 0:
            A[row, joint - 1] = -1.0


def _b_v(t, q, v, p, b_v):
    """Rows of A are constant."""


def hanging_leg(
    leg: HangingLeg, drive: MovingSprings = NO_DRIVE, locked: dict[int, float] | None = None
) -> ConstrainedSystem:
    """The leg as a constrained system.

    Args:
        leg: Lengths and masses.
        drive: Torques of its joints.
        locked: Joints (0 hip, 1 knee, 2 ankle) that are held, and the angles [rad] they are held at.
    """
    locked = locked or {}
    rows = [x for joint, angle in locked.items() for x in (float(joint), angle)]
    numbers = [np.ravel(part) for part in (*leg, *drive)]
    return ConstrainedSystem(
        n=LINKS,
        m=len(locked),
        mass=_mass,
        force=_force,
        phi=_phi,
        A=_A,
        b_v=_b_v,
        params=np.concatenate([*numbers, [9.81], rows]),
        name="hanging leg",
    )
