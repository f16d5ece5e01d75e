"""Four-bar linkages in a row, in natural coordinates: Figs 2.5 and 2.6 for two of them.

Joint j stands at (x_j, y_j), on a bar of length l from the fixed point (jl, 0); neighbouring joints are tied
by couplers of the same length. The mechanism is a parallelogram and has one degree of freedom, except lying
flat, where it has N + 1. A bar between joints has the mass matrix m/6 [2I I; I 2I], one with a fixed end m/3
at the joint; half of each bar's weight acts at each of its ends.
"""

import numpy as np

from biped.base.errors import InputError
from biped.dynamics.system import ConstrainedSystem

LENGTH = 1.0  # [m] of each bar
MASS = 1.0  # [kg] of each bar
GRAVITY = 9.81  # [m/s²]

CONSISTENT = (np.array([0.0, 1.0, 1.0, 1.0, 2.0, 1.0]), np.array([1.0, 0.0, 1.0, 0.0, 1.0, 0.0]))
"""q, v of two linkages standing upright, moving to the right at 1 m/s."""
INCONSISTENT = (np.array([0.0, 1.01, 1.0, 1.01, 1.99, 1.0]), np.array([0.99, 0.0, 1.0, 0.0, 1.01, 0.0]))
"""q, v of Fig 2.5's imperfect start."""


def _mass(t, q, v, p, M):
    m = p[1]
    joints = q.shape[0] // 2
    for j in range(joints):
        couplers = (j > 0) + (j < joints - 1)
        for i in (2 * j, 2 * j + 1):
            M[i, i] = m * (1 + couplers) / 3.0
            if j > 0:
                M[i, i - 2] = M[i - 2, i] = m / 6.0


def _force(t, q, v, p, Q):
    joints = q.shape[0] // 2
    for j in range(joints):
        couplers = (j > 0) + (j < joints - 1)
        Q[2 * j + 1] = -p[1] * p[2] * (1 + couplers) / 2.0


def _phi(t, q, v, p, phi):
    l = p[0]
    joints = q.shape[0] // 2
    for j in range(joints):
        phi[j] = (q[2 * j] - j * l) ** 2 + q[2 * j + 1] ** 2 - l * l
    for j in range(joints - 1):
        phi[joints + j] = (q[2 * j + 2] - q[2 * j]) ** 2 + (q[2 * j + 3] - q[2 * j + 1]) ** 2 - l * l


def _A(t, q, v, p, A):
    joints = q.shape[0] // 2
    for j in range(joints):
        A[j, 2 * j] = 2.0 * (q[2 * j] - j * p[0])
        A[j, 2 * j + 1] = 2.0 * q[2 * j + 1]
    for j in range(joints - 1):
        for i in (2 * j, 2 * j + 1):
            A[joints + j, i + 2] = 2.0 * (q[i + 2] - q[i])
            A[joints + j, i] = -A[joints + j, i + 2]


def _b_v(t, q, v, p, b_v):
    joints = q.shape[0] // 2
    for j in range(joints):
        b_v[j] = -2.0 * (v[2 * j] ** 2 + v[2 * j + 1] ** 2)
    for j in range(joints - 1):
        b_v[joints + j] = -2.0 * ((v[2 * j + 2] - v[2 * j]) ** 2 + (v[2 * j + 3] - v[2 * j + 1]) ** 2)


def _potential(t, q, v, p):
    joints = q.shape[0] // 2
    V = 0.0
    for j in range(joints):
        V += p[1] * p[2] * (1 + (j > 0) + (j < joints - 1)) / 2.0 * q[2 * j + 1]
    return V


def four_bars(
    linkages: int = 2, length: float = LENGTH, mass: float = MASS, gravity: float = GRAVITY
) -> ConstrainedSystem:
    """N four-bar linkages: 2(N + 1) coordinates, 2N + 1 constraints Φ [m²]: supports, then couplers."""
    if linkages < 1:
        raise InputError(f"four-bars: at least one linkage is needed, not {linkages}")
    return ConstrainedSystem(
        n=2 * (linkages + 1),
        m=2 * linkages + 1,
        mass=_mass,
        force=_force,
        phi=_phi,
        A=_A,
        b_v=_b_v,
        potential=_potential,
        params=(length, mass, gravity),
        name=f"{linkages} four-bars",
    )


def start(angle: float, rate: float, linkages: int = 2, length: float = LENGTH) -> tuple[np.ndarray, np.ndarray]:
    """q, v (2(N + 1),) with all supports at an angle [rad] from the horizontal, turning at a rate [rad/s]."""
    joints = np.arange(linkages + 1)
    q = np.stack((joints * length + length * np.cos(angle), np.full(linkages + 1, length * np.sin(angle))), 1)
    v = length * rate * np.tile([-np.sin(angle), np.cos(angle)], linkages + 1)
    return q.ravel(), v


def _angle_mass(t, q, v, p, M):
    M[0, 0] = p[1] * p[0] ** 2 * ((p[3] + 1.0) / 3.0 + p[3])


def _angle_force(t, q, v, p, Q):
    Q[0] = -p[1] * p[2] * p[0] * ((p[3] + 1.0) / 2.0 + p[3]) * np.cos(q[0])


def trusted(
    linkages: int = 2, length: float = LENGTH, mass: float = MASS, gravity: float = GRAVITY
) -> ConstrainedSystem:
    """The same linkages in the supports' common angle, without constraints; `CONSISTENT` is (π/2, −1)."""
    return ConstrainedSystem(
        n=1,
        m=0,
        mass=_angle_mass,
        force=_angle_force,
        params=(length, mass, gravity, linkages),
        name=f"{linkages} four-bars (angle)",
    )


def four_bars_mjcf(linkages: int = 2, length: float = LENGTH, mass: float = MASS, gravity: float = GRAVITY) -> str:
    """N linkages: cranks `crank0…N` on the ground, each but the last carrying `coupler0…N−1`.

    All bars point along +x at zero; hinges turn from +x to +z. Upright is crank π/2, coupler −π/2 [rad].
    """
    l, thin = length, 1e-6 * mass * length**2
    inertia = f'mass="{mass!r}" diaginertia="{thin!r} {mass * l * l / 12!r} {mass * l * l / 12!r}"'

    def bar(name: str, at: float, inside: str = "") -> str:
        return (
            f'<body name="{name}" pos="{at!r} 0 0"><joint name="{name}" axis="0 -1 0"/>'
            f'<inertial pos="{l / 2!r} 0 0" {inertia}/>{inside}</body>'
        )

    cranks = [bar(f"crank{j}", j * l, bar(f"coupler{j}", l) if j < linkages else "") for j in range(linkages + 1)]
    connects = [f'<connect body1="coupler{j}" body2="crank{j + 1}" anchor="{l!r} 0 0"/>' for j in range(linkages)]
    # Pinocchio reads one body of the world only, so the cranks share one. Flat, the reference pose closes
    # every loop: coupler j ends at (j + 2)l, where crank j + 1 does.
    return (
        f'<mujoco model="{linkages} four-bars"><compiler angle="radian"/>'
        f'<option gravity="0 0 {-gravity!r}"/>'
        f'<worldbody><body name="ground">{"".join(cranks)}</body></worldbody>'
        f"<equality>{''.join(connects)}</equality></mujoco>"
    )
