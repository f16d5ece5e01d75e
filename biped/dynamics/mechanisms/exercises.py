"""The three exercises of the seven-link biped: Figs 2.7–2.10, q = (x, y, θ, θ₁ … θ₆).

(x, y) is the torso's centre of mass; angles are absolute, counter-clockwise from +x, 1–3 thigh, shank and
foot of the forward leg, 4–6 of the backward one. Every point of the biped is
(x, y) + Σ (α_j u(θ_j) + β_j n(θ_j)) with u = (cos, sin) and n = (−sin, cos), so bodies and constraints are
rows of numbers, not code; the constraints prescribe the whole motion. Proportions: Table 2.1 (Winter) for
1.8 m and 75 kg; the foot's centre of mass lies 0.25·l₄ ahead of the ankle, at half the ankle's height (the
table does not give it).
"""

import numpy as np

from biped.base.errors import InputError
from biped.dynamics.system import ConstrainedSystem

HEIGHT = 1.8  # [m]
BODY_MASS = 75.0  # [kg]
GRAVITY = 9.81  # [m/s²]

TORSO, THIGH, SHANK, FOOT = (share * HEIGHT for share in (0.288, 0.245, 0.246, 0.152))
"""Lengths l₁ … l₄ [m]."""
HIP = 0.626 * TORSO  # below the torso's centre of mass
TOE, HEEL, ANKLE = 0.75 * FOOT, 0.25 * FOOT, 0.039 * HEIGHT  # ahead of, behind and below the ankle
_MASSES = (0.678, 0.1, 0.0465, 0.0145)
_RADII = (0.496 * TORSO, 0.323 * THIGH, 0.302 * SHANK, 0.475 * FOOT)  # of gyration

STARTS = {
    1: np.array([0.056, 1.220, 1.396, 1.920, 1.920, 0.0, 1.222, 1.222, 0.0]),
    2: np.array([0.056, 1.239, 1.396, 1.920, 1.920, 0.349, 1.292, 1.292, 0.0]),
    3: np.array([0.046, 1.252, 1.363, 1.363, 1.363, 0.0, 1.363, 1.363, 0.0]),
}
"""q at rest, from the captions of Figs 2.8–2.10: three digits, so no start satisfies its constraints."""

PERIODS = {1: 2.0, 2: 2.0, 3: 5.0}
"""[s] after which the configurations repeat."""

ROW = 26
"""Numbers of a constraint: factors of x, y, cos θ (7), sin θ (7), θ (7), and the target o + a·cos(ωt)."""


def point(leg: int, *offsets: tuple[float, float]) -> np.ndarray:
    """(2, 7) α and β of a point down a leg (0 forward, 1 backward): (α, β) on hip, thigh, shank, foot."""
    table = np.zeros((2, 7))
    places = [0, *range(1 + 3 * leg, 4 + 3 * leg)]
    for place, offset in zip(places, offsets, strict=False):
        table[:, place] = offset
    return table


def toe(leg: int) -> np.ndarray:
    """(2, 7) α and β of a toe."""
    return point(leg, (-HIP, 0.0), (-THIGH, 0.0), (-SHANK, 0.0), (TOE, -ANKLE))


def heel(leg: int) -> np.ndarray:
    """(2, 7) α and β of a heel."""
    return point(leg, (-HIP, 0.0), (-THIGH, 0.0), (-SHANK, 0.0), (-HEEL, -ANKLE))


def outline(q: np.ndarray, leg: int) -> np.ndarray:
    """(7, 2) shoulder, hip, knee, ankle, then around the foot to toe, heel (and the ankle again) [m]."""
    bones = ((-HIP, 0.0), (-THIGH, 0.0), (-SHANK, 0.0))
    ankle = point(leg, *bones)
    places = (point(0, (TORSO - HIP, 0.0)), point(leg, bones[0]), point(leg, *bones[:2]), ankle)
    drawn = (*places, toe(leg), heel(leg), ankle)
    c, s = np.cos(q[2:]), np.sin(q[2:])
    return q[:2] + np.array([(a @ c - b @ s, a @ s + b @ c) for a, b in drawn])


def _bodies() -> np.ndarray:
    """(7, 16) mass, moment of inertia, α and β of each centre of mass, in the order of the angles."""
    rows = [np.concatenate(([_MASSES[0], _RADII[0]], point(0).ravel()))]
    for leg in (0, 1):
        places = (
            point(leg, (-HIP, 0.0), (-0.433 * THIGH, 0.0)),
            point(leg, (-HIP, 0.0), (-THIGH, 0.0), (-0.433 * SHANK, 0.0)),
            point(leg, (-HIP, 0.0), (-THIGH, 0.0), (-SHANK, 0.0), (0.25 * FOOT, -0.5 * ANKLE)),
        )
        for share, radius, place in zip(_MASSES[1:], _RADII[1:], places, strict=True):
            rows.append(np.concatenate(([share, radius], place.ravel())))
    bodies = np.array(rows)
    bodies[:, 0] *= BODY_MASS
    bodies[:, 1] = bodies[:, 0] * bodies[:, 1] ** 2
    return bodies


BODIES = _bodies()


def _row(target: tuple[float, float, float], x: float = 0.0, y: float = 0.0) -> np.ndarray:
    row = np.zeros(ROW)
    row[:2] = x, y
    row[23:] = target
    return row


def _at_x(place: np.ndarray, value: float) -> np.ndarray:
    row = _row((value, 0.0, 0.0), x=1.0)
    row[2:9], row[9:16] = place[0], -place[1]
    return row


def _at_y(place: np.ndarray, value: float = 0.0) -> np.ndarray:
    row = _row((value, 0.0, 0.0), y=1.0)
    row[2:9], row[9:16] = place[1], place[0]
    return row


def _angle(factors: dict[int, float], offset: float, swing: float = 0.0, omega: float = 0.0) -> np.ndarray:
    row = _row((offset, swing, omega))
    for j, factor in factors.items():
        row[16 + j] = factor
    return row


def _knee(leg: int, swing: float, omega: float) -> np.ndarray:
    """Knee flexion swing·(1 − cos ωt)."""
    return _angle({1 + 3 * leg: 1.0, 2 + 3 * leg: -1.0}, swing, -swing, omega)


def _constraints(number: int) -> np.ndarray:
    """(m, ROW) constraints of an exercise, in the thesis's order."""
    back, front, pi = 1, 0, np.pi
    if number == 1:
        return np.array(
            [
                _at_x(toe(front), 0.507),
                _at_y(toe(front)),
                _at_y(heel(front)),
                _at_x(toe(back), -0.097),
                _at_y(toe(back)),
                _at_y(heel(back)),
                _angle({0: 1.0}, 4 * pi / 9),
                _knee(front, pi / 6, pi),
                _knee(back, pi / 10, pi),
            ]
        )
    if number == 2:
        return np.array(
            [
                _at_x(heel(front), 0.262),
                _at_y(heel(front)),
                _at_x(toe(back), -0.038),
                _at_y(toe(back)),
                _angle({0: 1.0}, 4 * pi / 9),
                _angle({3: 1.0}, pi / 18, pi / 18, pi),
                _angle({6: 1.0}, -pi / 18, pi / 18, pi),
                _knee(front, 0.0, 0.0),
                _knee(back, pi / 10, pi),
            ]
        )
    omega = 2 * pi / 5
    shares = BODIES[:, 0] / BODIES[:, 0].sum()
    centre = np.stack((shares @ BODIES[:, 2:9], shares @ BODIES[:, 9:]))
    return np.array(
        [
            _at_x(toe(front), 0.0),
            _at_y(toe(front)),
            _at_x(toe(back), 0.0),
            _at_y(toe(back)),
            _angle({0: 1.0}, 1.363),  # the text's 4π/9 fits neither the caption's start nor its residual
            _knee(front, pi / 3, omega),
            _knee(back, pi / 3, omega),
            _angle({3: 1.0}, -pi / 27, pi / 27, omega),
            _angle({6: 1.0}, -pi / 27, pi / 27, omega),
            _at_x(centre, 0.0),
        ]
    )


def _mass(t, q, v, p, M):
    for i in range(7):
        m = BODIES[i, 0]
        M[0, 0] += m
        M[1, 1] += m
        M[2 + i, 2 + i] += BODIES[i, 1]
        for j in range(7):
            cj, sj, aj, bj = np.cos(q[2 + j]), np.sin(q[2 + j]), BODIES[i, 2 + j], BODIES[i, 9 + j]
            if aj == 0.0 and bj == 0.0:
                continue
            xj, yj = -aj * sj - bj * cj, aj * cj - bj * sj
            M[0, 2 + j] += m * xj
            M[1, 2 + j] += m * yj
            for k in range(j + 1):
                ck, sk, ak, bk = np.cos(q[2 + k]), np.sin(q[2 + k]), BODIES[i, 2 + k], BODIES[i, 9 + k]
                M[2 + k, 2 + j] += m * (xj * (-ak * sk - bk * ck) + yj * (ak * ck - bk * sk))
    for i in range(9):
        for j in range(i):
            M[i, j] = M[j, i]


def _force(t, q, v, p, Q):
    for i in range(7):
        m = BODIES[i, 0]
        x, y = 0.0, -GRAVITY
        for j in range(7):
            c, s, a, b = np.cos(q[2 + j]), np.sin(q[2 + j]), BODIES[i, 2 + j], BODIES[i, 9 + j]
            x += (a * c - b * s) * v[2 + j] ** 2
            y += (a * s + b * c) * v[2 + j] ** 2
        Q[0] += m * x
        Q[1] += m * y
        for j in range(7):
            c, s, a, b = np.cos(q[2 + j]), np.sin(q[2 + j]), BODIES[i, 2 + j], BODIES[i, 9 + j]
            Q[2 + j] += m * (x * (-a * s - b * c) + y * (a * c - b * s))


def _phi(t, q, v, p, phi):
    for i in range(phi.shape[0]):
        row = p[ROW * i : ROW * (i + 1)]
        phi[i] = row[0] * q[0] + row[1] * q[1] - row[23] - row[24] * np.cos(row[25] * t)
        for j in range(7):
            phi[i] += row[2 + j] * np.cos(q[2 + j]) + row[9 + j] * np.sin(q[2 + j]) + row[16 + j] * q[2 + j]


def _A(t, q, v, p, A):
    for i in range(A.shape[0]):
        row = p[ROW * i : ROW * (i + 1)]
        A[i, 0], A[i, 1] = row[0], row[1]
        for j in range(7):
            A[i, 2 + j] = row[9 + j] * np.cos(q[2 + j]) - row[2 + j] * np.sin(q[2 + j]) + row[16 + j]


def _b_q(t, q, v, p, b_q):
    for i in range(b_q.shape[0]):
        row = p[ROW * i : ROW * (i + 1)]
        b_q[i] = -row[24] * row[25] * np.sin(row[25] * t)


def _b_v(t, q, v, p, b_v):
    for i in range(b_v.shape[0]):
        row = p[ROW * i : ROW * (i + 1)]
        b_v[i] = -row[24] * row[25] ** 2 * np.cos(row[25] * t)
        for j in range(7):
            b_v[i] += (row[2 + j] * np.cos(q[2 + j]) + row[9 + j] * np.sin(q[2 + j])) * v[2 + j] ** 2


def exercise(number: int) -> ConstrainedSystem:
    """Exercise 1 (both feet flat), 2 (heel and toe) or 3 (on the toes, ten constraints of rank nine)."""
    if number not in STARTS:
        raise InputError(f"there are exercises 1, 2 and 3, not {number}")
    rows = _constraints(number)
    return ConstrainedSystem(
        n=9,
        m=len(rows),
        mass=_mass,
        force=_force,
        phi=_phi,
        A=_A,
        b_q=_b_q,
        b_v=_b_v,
        params=rows.ravel(),
        name=f"exercise {number}",
    )
