"""A second program for the walk with joint torques, which shares no code with the package.

Everything but the physics is written anew from the thesis: Table 3.1's links in absolute coordinates, M and the rows of
A by the chain rule, (3.15) with pseudo-inverses, torque limits within (3.13) with SciPy. MuJoCo steps models/human.xml.
`python -m tests.independent_walk normal heel_toe 5` prints the means of five starts.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from math import pi, radians
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.optimize import lsq_linear

G = 9.81
TORSO, LEGS = 0, ((1, 2, 3), (4, 5, 6))  # angles theta; theta1 … theta3; theta4 … theta6
L, M = 1.8, 75.0
TRUNK, THIGH, SHANK, FOOT = (share * L for share in (0.288, 0.245, 0.246, 0.152))
HEIGHT = 0.039 * L
STARTS = {  # captions of Figs 3.4-3.6
    "heel_toe": (0.0, 1.27, 1.57, 1.82, 1.78, 0.2, 1.31, 1.04, -0.35),
    "flat": (0.0, 1.24, 1.5, 1.86, 1.86, 0.0, 1.23, 1.23, 0.0),
    "single": (0.0, 1.25, 1.3, 1.75, 1.75, 0.0, 1.2, 1.2, 0.0),
}


class Gait(NamedTuple):
    """Table 3.2; tuples hold for leg states 1 to 4."""

    k1: float = 400.0
    k2: tuple[float, ...] = (700.0, 70.0, 70.0, 0.0)
    k3: tuple[float, ...] = (30.0, 30.0, 0.0, 30.0)
    k4: tuple[float, ...] = (20.0, 20.0, 5.0, 5.0)
    b1: float = 50.0
    b2: tuple[float, ...] = (300.0, 1.0, 1.0, 0.0)
    b3: tuple[float, ...] = (5.0, 5.0, 1.0, 5.0)
    b4: tuple[float, ...] = (15.0, 15.0, 1.0, 1.0)
    torso: float = radians(87.5)
    thigh: tuple[float, ...] = tuple(map(radians, (68.0, 122.0, 122.0, 0.0)))
    ankle: tuple[float, ...] = tuple(map(radians, (0.0, 0.0, 10.0, 0.0)))


GAITS = {name: Gait(k2=(k, 70.0, 70.0, 0.0)) for name, k in (("slow", 600.0), ("normal", 700.0), ("fast", 800.0))}


class Reading(NamedTuple):
    """How the silent places of the thesis are filled: readings/bounded.toml, in numbers."""

    limit: float = 200.0
    release: float = 130.0
    height: float = 0.001
    knee: float = 0.02
    hold: tuple[int, int, int, int] = (0, 15, 0, 0)  # ticks: heel on, heel off, toe on, toe off
    extended: float = 0.05
    ahead: float = 0.33
    late: float = radians(100.0)
    single_tangential: bool = False
    friction: float = 100.0
    contact_time: float = 0.008
    damping_ratio: float = 1.0
    rank: float = 1e-4


# readings/plastic.toml
PLASTIC = Reading(
    limit=206.0, release=120.0, height=0.0013, hold=(3, 10, 0, 0), ahead=0.15, late=radians(99.0),
    single_tangential=True, contact_time=0.0064, damping_ratio=1.45,
)  # fmt: skip


Parts = tuple[tuple[int, float, float], ...]
"""A point as the torso's centre of mass plus, for each angle on the way, so much along u and so much along n."""


def _points() -> tuple[list[tuple[Parts, float, float, int]], list[Parts]]:
    """Centres of mass (parts, mass, inertia, angle) and the points right toe, right heel, left toe, left heel."""
    masses: list[tuple[Parts, float, float, int]] = [((), 0.678 * M, 0.678 * M * (0.496 * TRUNK) ** 2, TORSO)]
    points: list[Parts] = []
    hip: Parts = ((TORSO, -0.626 * TRUNK, 0.0),)
    for thigh, shank, foot in LEGS:
        knee = (*hip, (thigh, -THIGH, 0.0))
        ankle = (*knee, (shank, -SHANK, 0.0))
        masses += [
            ((*hip, (thigh, -0.433 * THIGH, 0.0)), 0.1 * M, 0.1 * M * (0.323 * THIGH) ** 2, thigh),
            ((*knee, (shank, -0.433 * SHANK, 0.0)), 0.0465 * M, 0.0465 * M * (0.302 * SHANK) ** 2, shank),
            ((*ankle, (foot, 0.25 * FOOT, -0.5 * HEIGHT)), 0.0145 * M, 0.0145 * M * (0.475 * FOOT) ** 2, foot),
        ]
        points += [(*ankle, (foot, 0.75 * FOOT, -HEIGHT)), (*ankle, (foot, -0.25 * FOOT, -HEIGHT))]
    return masses, points


MASSES, POINTS = _points()
JOINTS = np.zeros((6, 9))  # joint angles from absolute ones
for _leg, (_thigh, _shank, _foot) in enumerate(LEGS):
    for _joint, (_near, _far) in enumerate(((TORSO, _thigh), (_thigh, _shank), (_shank, _foot))):
        JOINTS[3 * _leg + _joint, 2 + _far], JOINTS[3 * _leg + _joint, 2 + _near] = 1.0, -1.0
KNEES = JOINTS[[1, 4]]
TO_MUJOCO = np.vstack([np.eye(9)[:3], JOINTS])
OFFSET = np.array([0.0, 0.0, -pi / 2, 0.0, 0.0, pi / 2, 0.0, 0.0, pi / 2])


class Motion(NamedTuple):
    """Place, Jacobian (2, 9) and velocity product of a point."""

    place: np.ndarray
    J: np.ndarray
    bias: np.ndarray


def point(parts: Parts, q: np.ndarray, v: np.ndarray) -> Motion:
    """Where a point is in absolute coordinates q, (9,), moving with v."""
    place, J, bias = q[:2].copy(), np.zeros((2, 9)), np.zeros(2)
    J[0, 0] = J[1, 1] = 1.0
    for angle, along, across in parts:
        c, s = np.cos(q[2 + angle]), np.sin(q[2 + angle])
        arm = along * np.array([c, s]) + across * np.array([-s, c])
        place += arm
        J[:, 2 + angle] += np.array([-arm[1], arm[0]])
        bias -= v[2 + angle] ** 2 * arm
    return Motion(place, J, bias)


def dynamics(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix and h + G in absolute coordinates."""
    mass, bias = np.zeros((9, 9)), np.zeros(9)
    for parts, m, inertia, angle in MASSES:
        at = point(parts, q, v)
        mass += m * at.J.T @ at.J
        mass[2 + angle, 2 + angle] += inertia
        bias += m * at.J.T @ (at.bias + np.array([0.0, G]))
    return mass, bias


@dataclass
class Controller:
    """The thesis's law; `believed` are its contacts after their holds."""

    gait: Gait
    reading: Reading = field(default_factory=Reading)
    believed: np.ndarray | None = None
    waiting: np.ndarray = field(default_factory=lambda: np.zeros(4, int))
    Q_d: np.ndarray = field(default_factory=lambda: np.zeros(9))

    def torques(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Joint torques (6,) [N m] at absolute coordinates q and rates v, both (9,)."""
        points = [point(parts, q, v) for parts in POINTS]
        touching = np.array([at.place[1] < self.reading.height for at in points])
        self._believe(touching)
        Q_d = self.Q_d = self._springs(q, v)
        mass, bias = dynamics(q, v)
        root = np.linalg.cholesky(mass).T
        active = touching.copy()
        while True:
            A, b, normal = self._rows(points, active, q)
            C = np.linalg.solve(root.T, A.T).T
            inverse = np.linalg.pinv(C, rcond=self.reading.rank) if len(C) else np.zeros((9, 0))
            force = inverse.T @ (inverse @ (b - A @ np.linalg.solve(mass, Q_d - bias)))
            pulls = [(force[row], i) for i, row in normal.items() if force[row] < -self.reading.release]
            if not pulls:
                break
            active[min(pulls)[1]] = False
        N = np.eye(9) - inverse @ C
        wanted = N @ np.linalg.solve(root.T, np.column_stack([JOINTS.T, Q_d]))
        B, d = wanted[:, :6], wanted[:, 6]
        u = np.linalg.pinv(B, rcond=self.reading.rank) @ d
        limit = self.reading.limit
        if np.abs(u).max() <= limit:
            return u
        tie = np.sqrt(1e-8 * np.trace(B.T @ B)) * np.eye(6)  # the shortest of several minimisers
        problem = np.vstack([B, tie]), np.concatenate([d, np.zeros(6)])
        return lsq_linear(*problem, bounds=(-limit, limit), method="bvls", tol=1e-14).x

    def _believe(self, touching: np.ndarray) -> None:
        if self.believed is None:
            self.believed = touching.copy()
            return
        for i, now in enumerate(touching):
            self.waiting[i] = 0 if now == self.believed[i] else self.waiting[i] + 1
            hold = self.reading.hold[(0 if i % 2 else 2) + (0 if now else 1)]
            if now != self.believed[i] and self.waiting[i] >= hold:
                self.believed[i], self.waiting[i] = now, 0

    def _state(self, leg: int, q: np.ndarray) -> int:
        assert self.believed is not None
        toe, heel = self.believed[2 * leg : 2 * leg + 2]
        thigh, other = q[2 + LEGS[leg][0]], q[2 + LEGS[1 - leg][0]]
        if heel or (toe and thigh > self.reading.late):
            return 0
        if toe:
            return 1
        straight = KNEES[leg] @ q > -self.reading.extended
        return 3 if straight and thigh - other > self.reading.ahead else 2

    def _springs(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Q_d, (3.16)-(3.17), in absolute coordinates."""
        g, Q = self.gait, np.zeros(9)
        Q[2] = -g.k1 * (q[2] - g.torso) - g.b1 * v[2]
        joint, rate = JOINTS @ q, JOINTS @ v
        for leg, (thigh, _, _) in enumerate(LEGS):
            s = self._state(leg, q)
            Q[2 + thigh] += -g.k2[s] * (q[2 + thigh] - g.thigh[s]) - g.b2[s] * v[2 + thigh]
            knee, ankle = 3 * leg + 1, 3 * leg + 2
            Q += JOINTS[knee] * (-g.k3[s] * joint[knee] - g.b3[s] * rate[knee])
            Q += JOINTS[ankle] * (-g.k4[s] * (joint[ankle] + pi / 2 - g.ankle[s]) - g.b4[s] * rate[ankle])
        return Q

    def _rows(
        self, points: list[Motion], active: np.ndarray, q: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, dict[int, int]]:
        """A (m, 9), b = -J̇v (m,) and the row of each active point's normal."""
        rows, right, normal = [], [], {}
        for i, at in enumerate(points):
            if active[i]:
                normal[i] = len(rows)
                alone = i % 2 or not active[i + 1]  # of a flat foot the heel's no-slip row says all
                axes = (1, 0) if alone or not self.reading.single_tangential else (1,)
                rows += [at.J[axis] for axis in axes]
                right += [-at.bias[axis] for axis in axes]
        for knee in KNEES:
            if -knee @ q < self.reading.knee:
                rows.append(knee)
                right.append(0.0)
        return np.array(rows).reshape(-1, 9), np.array(right), normal


class Walk(NamedTuple):
    """What a run left behind, a row for each tick: joint coordinates, rates, torques, loads of the feet."""

    q: np.ndarray
    v: np.ndarray
    u: np.ndarray
    load: np.ndarray
    fell: bool


def model_of(path: Path, reading: Reading) -> mujoco.MjModel:
    """MuJoCo's model of a file with the ground and the limits of a reading."""
    spec = mujoco.MjSpec.from_file(str(path))
    for pair in spec.pairs:
        pair.friction = [reading.friction, reading.friction, 0.005, 0.0001, 0.0001]
        pair.solref = [reading.contact_time, reading.damping_ratio]
    for name in ("right_knee", "left_knee"):
        spec.joint(name).solref_limit = [reading.contact_time, reading.damping_ratio]
    for motor in spec.actuators:
        motor.ctrlrange = [-reading.limit, reading.limit]
    return spec.compile()


def walk(path: Path, gait: str, start: np.ndarray, duration: float, reading: Reading | None = None) -> Walk:
    """Walks from absolute coordinates at rest, 1000 ticks a second, until a fall."""
    reading = reading or Reading()
    model, control = model_of(path, reading), Controller(GAITS[gait], reading)
    data = mujoco.MjData(model)
    data.qpos[:] = TO_MUJOCO @ start + OFFSET
    feet = [model.body(name).id for name in ("right_foot", "left_foot")]
    back, log, force = np.linalg.inv(TO_MUJOCO), [], np.zeros(6)
    fell = False
    for _ in range(round(1000 * duration)):
        q, v = back @ (data.qpos - OFFSET), back @ data.qvel
        if q[1] < 0.7 * start[1] or abs(q[2] - pi / 2) > radians(60.0):
            fell = True
            break
        before = data.qpos.copy(), data.qvel.copy()
        data.ctrl[:] = control.torques(q, v)
        mujoco.mj_step(model, data)
        load = np.zeros(2)
        for i in range(data.ncon):
            mujoco.mj_contactForce(model, data, i, force)
            load[feet.index(model.geom_bodyid[data.contact[i].geom[1]])] += force[0]
        log.append((*before, data.ctrl.copy(), load))
    return Walk(*(np.array(column) for column in zip(*log, strict=True)), fell)


def means(run: Walk, start: float = 5.0) -> dict[str, float]:
    """Speed, net cost of transport and share of double support, from so many seconds on."""
    q, v, u, load = (rows[round(1000 * start) :] for rows in run[:4])
    way = q[-1, 0] - q[0, 0]
    power = (u[:-1] * (v[:-1, 3:] + v[1:, 3:]) / 2.0).sum(axis=1)  # torques and mean rates of a tick
    return {
        "speed": way / (1e-3 * (len(q) - 1)),
        "cost_of_transport": float(np.abs(power).sum() * 1e-3 / (M * G * way)),
        "double_support": float((load > 0.0).all(axis=1).mean()),
    }


if __name__ == "__main__":
    file = Path(__file__).parents[1] / "models" / "human.xml"
    generator = np.random.default_rng(1)
    for _ in range(int(sys.argv[3])):
        q0 = np.array(STARTS[sys.argv[2]])
        q0[2:] += 0.002 * generator.standard_normal(7)
        one = walk(file, sys.argv[1], q0, 10.0)
        print("fell" if one.fell else means(one))
