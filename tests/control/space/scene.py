"""The human out of its plane in states of a test's choice, with the law's record, and matrices from Pinocchio."""

from __future__ import annotations

from functools import cache
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from biped.base.files import locate
from biped.control.law import Setup
from biped.control.space.places import point_motion, sense_places
from biped.control.space.setup import controller_record, mechanics_of
from biped.ensemble.plan import Plan
from biped.robot.build import compiled
from biped.robot.recognise import robot_of
from biped.scenario.reading import read_scenario

N, BASE, LEG = 18, 6, 6
DOWN = np.array([0.0, 0.0, -9.81])


class Scene:
    """A model, its data and a controller record."""

    def __init__(self, *changes: str):
        run = Plan(read_scenario("spatial/own", changes)).run(0)
        s = run.scenario
        assert s.robot is not None
        self.robot = robot_of(run.model, s.robot)
        self.model = compiled(run.model, s, "torque")
        self.data = mujoco.MjData(self.model)
        self.q, self.v = run.q, run.v
        self.setup = Setup(
            s, run.gains, self.robot, self.model, run.model, 1e-3, np.array(run.torque_limits), run.q, run.v
        )
        self.record = controller_record(self.setup)
        self.c: Any = self.record[0]
        self.points = [geom for foot in self.robot.feet for geom in foot.geoms]
        self.mechanics = mechanics_of(self.c, self.model, self.data)

    def put(self, q: np.ndarray, v: np.ndarray) -> None:
        """Puts the walker into a state."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:], self.data.qvel[:] = q, v
        mujoco.mj_step1(self.model, self.data)

    def sensed(self, q: np.ndarray, v: np.ndarray) -> None:
        """Puts it there, and lets the law sense where it is."""
        self.put(q, v)
        sense_places(self.c, self.mechanics)
        point_motion(self.c, self.mechanics)

    def M(self) -> np.ndarray:
        """(18, 18) as the record has it."""
        out, at = np.zeros((N, N)), self.c["at"]
        out[:BASE, :BASE] = at["M_base"]
        for leg in range(2):
            mine = slice(BASE + LEG * leg, BASE + LEG * (leg + 1))
            out[mine, mine], out[mine, :BASE] = at["M_leg"][leg], at["M_cross"][leg]
            out[:BASE, mine] = at["M_cross"][leg].T
        return out

    def J(self, point: int) -> np.ndarray:
        """(3, 18) of a contact point: up, forward, left."""
        out, leg, lane = np.zeros((3, N)), point // 4, 12 * (point // 4) + 3 * (point % 4)
        A = self.c["at"]["A"][:, lane : lane + 3]
        out[:, :BASE], out[:, BASE + LEG * leg : BASE + LEG * (leg + 1)] = A[:BASE].T, A[BASE:].T
        return out


def states(scene: Scene, number: int, seed: int = 0) -> list[tuple[np.ndarray, np.ndarray]]:
    """Random states around the start, turned every way."""
    rng, out = np.random.default_rng(seed), []
    for _ in range(number):
        q = scene.q.copy()
        q[3:7] += 0.3 * rng.standard_normal(4)
        q[3:7] /= np.linalg.norm(q[3:7])
        q[7:] += 0.3 * rng.standard_normal(12)
        out.append((q, rng.standard_normal(N)))
    return out


@cache
def _pinocchio() -> Any:
    return pin.buildModelFromMJCF(str(locate("models", "human3d", "model")))


class Referee:
    """Pinocchio's mechanics in MuJoCo's coordinates: its base's velocities are along the base's own axes."""

    def __init__(self, q: np.ndarray, v: np.ndarray):
        self.model, self.v = _pinocchio(), v
        self.data: Any = self.model.createData()
        self.q = np.concatenate([q[:3], q[4:7], q[3:4], q[7:]])
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, q[3:7])
        self.T = np.eye(N)
        self.T[:3, :3] = turn.reshape(3, 3).T
        # No acceleration of MuJoCo's coordinates is one of Pinocchio's, whose base's axes turn.
        self.still = np.zeros(N)
        self.still[:3] = -np.cross(v[3:6], self.T[:3, :3] @ v[:3])

    @property
    def M(self) -> np.ndarray:
        """(18, 18)."""
        M = np.triu(pin.crba(self.model, self.data, self.q))
        M = M + np.triu(M, 1).T
        return self.T.T @ M @ self.T

    @property
    def h(self) -> np.ndarray:
        """(18,) bias forces with gravity."""
        return self.T.T @ pin.rnea(self.model, self.data, self.q, self.T @ self.v, self.still)

    def point(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian (3, 18) and J̇v (3,) of a site, along x, y and z."""
        pin.computeJointJacobians(self.model, self.data, self.q)
        pin.forwardKinematics(self.model, self.data, self.q, self.T @ self.v, self.still)
        pin.updateFramePlacements(self.model, self.data)
        frame, axes = self.model.getFrameId(name), pin.LOCAL_WORLD_ALIGNED
        J = pin.getFrameJacobian(self.model, self.data, frame, axes)[:3] @ self.T
        return J, pin.getFrameClassicalAcceleration(self.model, self.data, frame, axes).linear

    def com(self) -> tuple[np.ndarray, np.ndarray]:
        """Centre of mass and its velocity."""
        place = pin.centerOfMass(self.model, self.data, self.q, self.T @ self.v)
        return place, self.data.vcom[0]
