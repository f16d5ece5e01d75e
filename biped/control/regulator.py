"""Standing on feet that are points: a linear-quadratic regulator about an upright equilibrium.

Two points bear no moment about the line through them, so that only turning parts of the body moves the centre of mass
across it. The motion near the equilibrium, contacts included, is linearised by finite differences of MuJoCo's own step.
"""

import mujoco
import numpy as np
from scipy.optimize import least_squares

from biped.control.law import Setup
from biped.control.observation import Observation
from biped.robot.posture import height_of
from biped.robot.robot import Robot
from biped.robot.soles import points_of

_BALANCE = 1000.0
"""Price of the centre of mass's distance [m] from above the feet, squared; of joints' deviations [rad] it is 1."""
_RATE = 1e-2
"""Price of velocities."""
_TORQUE = 1.0
"""Price of a torque at its limit."""
_UNLIMITED = 200.0
"""[N m] that stands for the limit of an actuator without one."""
_STEP = 1e-6
_DOUBLINGS = 12
"""4 s at 1 kHz."""


class Regulator:
    """See the module.

    Args:
        setup: What the robot is, and where it starts: it is kept near that posture, turned until it balances.
    """

    def __init__(self, setup: Setup):
        model, robot = setup.model, setup.robot
        self._model, self._limit = model, setup.torque_limit
        data = mujoco.MjData(model)
        data.qpos[:] = setup.q
        _balanced(model, data, robot)
        self._q = data.qpos.copy()
        data.qacc[:] = 0.0
        mujoco.mj_inverse(model, data)
        moment = np.zeros((model.nu, model.nv))
        moment[np.arange(model.nu), robot.columns] = 1.0
        self._held = np.linalg.lstsq(moment.T, data.qfrc_inverse, rcond=None)[0]
        A, B = np.zeros((2 * model.nv, 2 * model.nv)), np.zeros((2 * model.nv, model.nu))
        data.ctrl[:] = self._held
        if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER  # of this copy: the other has no such differences
        mujoco.mjd_transitionFD(model, data, _STEP, True, A, B, None, None)
        self._K = self._gain(data, setup, A, B)
        self._away = np.empty(model.nv)

    def _gain(self, data: mujoco.MjData, setup: Setup, A: np.ndarray, B: np.ndarray) -> np.ndarray:
        """(nu, 2 nv) feedback that is cheapest."""
        model, robot, nv = setup.model, setup.robot, setup.model.nv
        sensed = Observation(model, data, robot)
        feet = sensed.J.reshape(-1, 3, nv).mean(axis=0)
        apart = (sensed.J_com() - feet)[:2]
        price = np.eye(nv)
        price[list(robot.base_columns), list(robot.base_columns)] = 1e-2
        Q = np.zeros((2 * nv, 2 * nv))
        Q[:nv, :nv] = price + _BALANCE * apart.T @ apart
        Q[nv:, nv:] = _RATE * price
        limit = np.minimum(setup.torque_limit, _UNLIMITED)
        R = np.diag(_TORQUE / limit**2)
        P = _cost_to_go(A, B @ np.linalg.solve(R, B.T), Q)
        return np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)

    def torques(self, sensed: Observation) -> np.ndarray:
        """(nu,) [N m]."""
        mujoco.mj_differentiatePos(self._model, self._away, 1.0, self._q, sensed.q)
        return self._held - self._K @ np.concatenate([self._away, sensed.v])


def _cost_to_go(A: np.ndarray, G: np.ndarray, H: np.ndarray) -> np.ndarray:
    """The price of 2^_DOUBLINGS steps from each state, by doubling (Chu, Fan and Lin, 2005).

    Feet creep a little on MuJoCo's ground, which nothing can stop: for ever there is no price.
    """
    for _ in range(_DOUBLINGS):
        once = np.linalg.solve(np.eye(len(A)) + G @ H, np.hstack([A, G]))
        AA, AG = once[:, : len(A)], once[:, len(A) :]
        A, G, H = A @ AA, G + A @ AG @ A.T, H + A.T @ H @ AA
    return H


def _balanced(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot) -> None:
    """Turns the robot and lets it down until the ground bears it without anything pushing its base."""
    up, axis = robot.moving_columns[-1], robot.pitch_column
    start, height, turn = data.qpos.copy(), height_of(model, robot), np.zeros(model.nv)

    def missing(x: np.ndarray) -> np.ndarray:
        """Force and moment that would have to act on the base, turned by x[0] [rad] and with feet x[1] [mm] deep."""
        data.qpos[:] = start
        turn[axis] = x[0]
        mujoco.mj_integratePos(model, data.qpos, turn, 1.0)
        mujoco.mj_kinematics(model, data)
        data.qpos[height] -= _under(model, data, robot) + 1e-3 * x[1]
        mujoco.mj_forward(model, data)
        data.qacc[:] = 0.0
        mujoco.mj_inverse(model, data)
        return data.qfrc_inverse[[up, axis]].copy()

    found = least_squares(missing, np.array([0.0, 0.2]), x_scale=(0.01, 0.1), diff_step=1e-4)
    missing(found.x)


def _under(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot) -> float:
    """[m] height of the lowest point of the feet's geoms as they lie."""
    return min(float(points_of(model, data, geom)[:, 2].min()) for foot in robot.feet for geom in foot.geoms)
