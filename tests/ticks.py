"""A control tick on the bench: one configuration in, torques out, with MuJoCo's numbers for the oracles to use."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import mujoco
import numpy as np

from biped.base.files import folder
from biped.base.jit import kernel
from biped.control.planar.allocation import joint_torques
from biped.control.planar.sensing import sense_links
from biped.control.planar.setup import controller_record
from biped.control.planar.tick import pushing_tick, thesis_tick
from biped.ensemble.plan import Plan
from biped.robot.columns import WIDTH
from biped.robot.planar.build import compile_foreign
from biped.robot.planar.description import description_at
from biped.robot.planar.kinematics import mass_matrix
from biped.robot.planar.model import tree_at
from biped.robot.planar.order import believed_model
from biped.scenario.devices import Actuation
from biped.scenario.keys import Scenario
from biped.scenario.world import Ground

HUMAN = folder("models") / "human.xml"
POINTS = description_at(HUMAN).points
E = np.vstack([np.zeros((3, 6)), np.eye(6)])

# Joint coordinates of the thesis's absolute ones, written down from its definitions: pitch θ - π/2, hip θ1 - θ,
# knee θ2 - θ1, ankle θ3 - θ2 + π/2, and the same for 4, 5, 6.
S = np.zeros((9, 9))
S[0, 0] = S[1, 1] = S[2, 2] = 1.0
for leg in (3, 6):
    S[leg, leg], S[leg, 2] = 1.0, -1.0
    S[leg + 1, leg + 1], S[leg + 1, leg] = 1.0, -1.0
    S[leg + 2, leg + 2], S[leg + 2, leg + 1] = 1.0, -1.0
OFFSET = np.array([0, 0, -1, 0, 0, 1, 0, 0, 1]) * np.pi / 2


class Dynamics(NamedTuple):
    """MuJoCo's view of a configuration.

    Attributes:
        M: (9, 9) mass matrix.
        h: (9,) bias forces.
        J: (8, 9) normal and tangential Jacobian rows of the points.
        height: (4,) heights of the points.
    """

    M: np.ndarray
    h: np.ndarray
    J: np.ndarray
    height: np.ndarray


@lru_cache(maxsize=4)
def foreign(slope: float = 0.0):
    return compile_foreign(HUMAN, Scenario(ground=Ground(slope=slope))).model


def dynamics(q, v, slope: float = 0.0) -> Dynamics:
    model = foreign(slope)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    M = np.zeros((9, 9))
    mujoco.mj_fullM(model, data, M)
    J = np.zeros((8, 9))
    for i, point in enumerate(POINTS):
        whole = np.zeros((3, 9))
        mujoco.mj_jacSite(model, data, whole, None, model.site(point).id)
        J[2 * i], J[2 * i + 1] = whole[2], whole[0]
    return Dynamics(M, data.qfrc_bias.copy(), J, data.site_xpos[[model.site(p).id for p in POINTS], 2].copy())


def jdot_v(q, v) -> np.ndarray:
    """J̇v (8,) of the points by central differences along the motion q + v t."""
    e = 1e-5
    ahead, behind = (dynamics(q + s * e * v, v).J for s in (1.0, -1.0))
    return (ahead - behind) @ v / (2 * e)


@kernel
def _allocate(record, q, v):
    c = record[0]
    sense_links(c, q, v)
    mass_matrix(c["tree"], c["at"], c["work"]["M"])
    c["tick"]["over"] = joint_torques(c, c["work"]["M"], q)


class Bench:
    """A controller record that ticks at configurations of one's choice.

    Args:
        scenario: What the controller is told; torque limits are lifted unless it sets them.
        general: Whether torques are those of `biped.control.planar.allocation` even where floating ones suffice.
    """

    def __init__(self, scenario: Scenario | None = None, general: bool = False):
        self.general = general
        scenario = scenario or Scenario(actuation=Actuation(torque_limit=1e9))
        self.run = Plan(scenario).run(0)
        self.record = controller_record(self.run, tree_at(self.run.model))
        self.c = self.record[0]
        self.model = believed_model(self.run.model, scenario.ground.slope)
        self.data = self.model.createData()
        self.log = np.zeros((10_000, WIDTH))

    def tick(self, q, v, k: int = 0) -> np.ndarray:
        """One tick; returns the torques."""
        tick = pushing_tick if self.c["push"]["on"] else thesis_tick
        assert tick(self.record, q, v, self.log, k, 0.001 * k) == 0
        if self.general:
            _allocate(self.record, q, v)
        return self.c["tick"]["u"].copy()

    @property
    def active(self) -> tuple[int, ...]:
        return tuple(self.c["tick"]["active"])


def states(count: int, seed: int, speed: float = 2.0):
    """Random configurations that touch the ground with none to four points, knees straight or not, feet flat or not."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        q, v = rng.normal(0.0, 0.4, 9), speed * rng.normal(size=9)
        for knee in (4, 7):
            q[knee] = -abs(q[knee]) - 0.05 if rng.random() < 0.7 else -0.01 * rng.random()
        if rng.random() < 0.4:
            foot = rng.choice([3, 6])
            q[foot + 2] = -q[2] - q[foot] - q[foot + 1]
        height = np.sort(dynamics(q, v).height)
        touching = i % 5
        q[1] -= (height[0] - 0.01) if touching == 0 else height[touching - 1]
        yield q, v


def rows_of(active, d: Dynamics, jv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and b_v of a set of active constraints (four points, two knees), from MuJoCo's Jacobians."""
    A, b = [], []
    for i in range(4):
        if active[i]:
            A += [d.J[2 * i], d.J[2 * i + 1]]
            b += [-jv[2 * i], -jv[2 * i + 1]]
    for leg in range(2):
        if active[4 + leg]:
            A.append(np.eye(9)[4 + 3 * leg])
            b.append(0.0)
    return np.array(A).reshape(-1, 9), np.array(b)


def torques(M, A, Q_d, rcond: float, u_0=None) -> np.ndarray:
    """(3.15) as the thesis prints it, with pseudo-inverses: u = (N R⁻ᵀE)⁺ N R⁻ᵀ Q_d; with u_0, (4.7)."""
    R = np.linalg.cholesky(M).T
    R_T = np.linalg.inv(R).T
    C = A @ np.linalg.inv(R)
    N = np.eye(9) - np.linalg.pinv(C, rcond=rcond) @ C if len(A) else np.eye(9)
    A_u = N @ R_T @ E
    if np.abs(A_u).max() < 1e-9 * np.abs(R_T @ E).max():  # nothing can move, and N is rounding noise
        return np.zeros(6) if u_0 is None else u_0
    inverse = np.linalg.pinv(A_u, rcond=rcond)
    u = inverse @ (N @ R_T @ Q_d)
    return u if u_0 is None else u + (np.eye(6) - inverse @ A_u) @ u_0


def well_ranked(M, A, low: float = 1e-7, high: float = 3e-3) -> bool:
    """Whether no singular value is so close to the rank tolerance that pivoting and SVD may disagree on the rank."""
    R = np.linalg.cholesky(M).T
    C = A @ np.linalg.inv(R)
    if not len(A):
        return True
    N = np.eye(9) - np.linalg.pinv(C, rcond=1e-4) @ C
    for matrix in (C, N @ np.linalg.inv(R).T @ E):
        s = np.linalg.svd(matrix, compute_uv=False)
        ratio = s / s[0]
        if ((ratio > low) & (ratio < high)).any():
            return False
    return True
