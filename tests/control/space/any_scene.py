"""A biped of any kind in states of a test's choice, with the law's record, and what MuJoCo says of it by itself."""

from __future__ import annotations

from functools import cache
from typing import Any

import mujoco
import numpy as np

from biped.control.law import Setup
from biped.control.observation import Observation
from biped.control.space.law import Spatial
from biped.control.space.setup import mechanics_of
from biped.ensemble.plan import Plan
from biped.robot.anatomy import anatomy_of
from biped.robot.build import compiled
from biped.scenario.reading import read_scenario


class AnyScene:
    """A robot with its law.

    Args:
        scenario: Its name.
        changes: To it.
    """

    def __init__(self, scenario: str, *changes: str):
        run = Plan(read_scenario(scenario, changes)).run(0)
        s = run.scenario
        self.robot, self.q, self.v = run.robot, run.q, run.v
        self.model = compiled(run.model, s, Spatial.command(s))
        self.data = mujoco.MjData(self.model)
        self.anatomy = anatomy_of(self.model, self.robot)
        self.setup = Setup(
            s, run.gains, self.robot, self.model, run.model, 1e-3, np.array(run.torque_limits), run.q, run.v
        )
        self.law = Spatial(self.setup)
        self.c: Any = self.law.record[0]
        self.mechanics = mechanics_of(self.c, self.model, self.data)
        self.sensed = Observation(self.model, self.data, self.robot)

    def put(self, q: np.ndarray, v: np.ndarray) -> None:
        """Puts the walker into a state."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:], self.data.qvel[:] = q, v
        mujoco.mj_step1(self.model, self.data)

    def torques(self) -> np.ndarray:
        """What the law commands there, as at a first tick."""
        self.sensed.begin(0.0)
        return self.law.torques(self.sensed)

    def states(self, number: int, seed: int = 0) -> list[tuple[np.ndarray, np.ndarray]]:
        """Random states around the start, low enough to touch the ground."""
        rng, out = np.random.default_rng(seed), []
        for _ in range(number):
            q = self.q.copy()
            mujoco.mj_integratePos(self.model, q, 0.05 * rng.standard_normal(self.model.nv), 1.0)
            v = self.v + 0.2 * rng.standard_normal(self.model.nv)
            self.put(q, v)
            q[2] -= self.soles()[:, 2].min()
            out.append((q, v))
        return out

    def soles(self) -> np.ndarray:
        """(8, 3) [m] corners of the soles, by MuJoCo's own frames."""
        return np.concatenate([self.data.xpos[leg.foot] + leg.sole @ self.data.xmat[leg.foot].reshape(3, 3).T
                               for leg in self.anatomy.legs])  # fmt: skip

    def M(self) -> np.ndarray:
        """(nv, nv) by MuJoCo."""
        out = np.empty((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, out)
        return out

    def J(self, point: int) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian (3, nv) of a corner, up, forward and left, and J̇v (3,), by MuJoCo."""
        J, rate = np.empty((3, self.model.nv)), np.empty((3, self.model.nv))
        body, place = self.anatomy.legs[point // 4].foot, self.soles()[point]
        mujoco.mj_jac(self.model, self.data, J, None, place, body)
        mujoco.mj_jacDot(self.model, self.data, rate, None, place, body)
        order = [2, 0, 1]
        return J[order], (rate @ self.data.qvel)[order]


@cache
def h1(*changes: str) -> AnyScene:
    """Unitree's H1: nine joints above the legs, one hinge of each ankle, damping in every joint."""
    return AnyScene("any/h1_walk", *changes)
