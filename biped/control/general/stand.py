"""Standing for any robot: ground forces that balance its centre of mass, and springs that keep its posture.

What the ground must push with follows from where the centre of mass is, how fast it moves and how the base leans; it is
shared among the contact points that touch, which only push and only within friction; joint torques are what bears it
(Ott, Roa and Hirzinger, "Posture and balance control for biped robots based on contact force optimization", 2011).
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from scipy.optimize import nnls

from biped.control.general.law import Setup
from biped.control.general.regulator import Regulator
from biped.control.general.sensed import Sensed
from biped.robot.legs import above
from biped.robot.robot import Robot

SWAY = 1.5
"""Frequency of the centre of mass's return / that of its fall, sqrt(g / height)."""
TURN = 6.0
"""[rad/s] frequency of the base's return to its orientation."""
POSTURE = 12.0
"""[rad/s] of the joints' to their posture."""
USED = 0.8
"""Share of the friction that is used."""
_NEAR = 0.01
"""[m] above the lowest point within which a contact point counts as touching."""
_EDGES = 4
_PRICE = 1e-3
"""Of ground forces, beside what they are for."""


def stand(setup: Setup) -> Stand | Regulator:
    """The law `stand`: by forces of the ground, or on feet that are points by a regulator."""
    return Regulator(setup) if all(len(foot.points) == 1 for foot in setup.robot.feet) else Stand(setup)


class Stand:
    """See the module.

    Args:
        setup: What the robot is, and where it starts: that posture is kept.
    """

    def __init__(self, setup: Setup):
        robot, model = setup.robot, setup.model
        self._robot, self._planar = robot, robot.planar
        data = mujoco.MjData(model)
        data.qpos[:] = setup.q
        mujoco.mj_forward(model, data)
        start = Sensed(model, data, robot)
        self._places, self._columns = robot.places, robot.columns
        self._posture, self._orientation = setup.q[self._places], start.base.orientation
        inertia = 1.0 / np.diag(np.linalg.inv(start.M))[self._columns]  # felt at each joint alone
        self._k, self._b = POSTURE**2 * inertia, 2.0 * POSTURE * inertia
        points, com = start.points, start.com
        self._height = float(com[2] - points[:, 2].min())
        self._gravity = np.array(model.opt.gravity)
        self._mass = robot.mass
        way = SWAY * math.sqrt(float(np.linalg.norm(self._gravity)) / self._height)
        self._sway = way**2, 2.0 * way
        self._trunk = trunk_inertia(model, data, robot)
        # Forces [weights] and moments [weights x heights] count alike; out of the plane nothing does.
        weight = self._mass * float(np.linalg.norm(self._gravity))
        scale = np.array([1.0, 1.0, 1.0, *(1.0 / self._height,) * 3]) / weight
        self._rows = np.array([0, 2, 4]) if self._planar else np.arange(6)
        self._scale = (scale * [1.0, 1.0, 1.0, 2.0, 2.0, 1.0])[self._rows]
        friction = USED * setup.scenario.ground.friction
        angles = np.pi * np.arange(2) if self._planar else 2.0 * np.pi * (np.arange(_EDGES) + 0.5) / _EDGES
        edges = np.column_stack([friction * np.cos(angles), friction * np.sin(angles), np.ones(len(angles))])
        self._edges = edges / math.sqrt(1.0 + friction**2)
        self._weight = weight

    def torques(self, sensed: Sensed) -> np.ndarray:
        """(nu,) [N m]."""
        points, height = sensed.points, sensed.height
        low = height < height.min() + _NEAR
        force = np.zeros_like(points)
        force[low] = self._shared(self._wanted(sensed, points[low]), points[low] - sensed.com)
        q, v = sensed.q[self._places], sensed.v[self._columns]
        spring = self._k * (self._posture - q) - self._b * v
        return spring + (sensed.h - sensed.J.T @ force.ravel())[self._columns]

    def _wanted(self, sensed: Sensed, points: np.ndarray) -> np.ndarray:
        """(6,) [N, N m] force of the ground, and its moment about the centre of mass."""
        com, base, down = sensed.com, sensed.base, self._gravity / -self._gravity[2]
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        rest = middle - self._height * down  # above the middle of what it stands on, against gravity
        k, b = self._sway
        force = self._mass * (k * (rest - com) - b * sensed.com_velocity - self._gravity)
        error = _rotation(self._orientation @ base.orientation.T)
        moment = self._trunk @ (TURN**2 * error - 2.0 * TURN * base.angular_velocity)
        return np.concatenate([force, moment])

    def _shared(self, wanted: np.ndarray, arms: np.ndarray) -> np.ndarray:
        """(k, 3) [N] on points at arms (k, 3) [m] from the centre of mass, as near to what is wanted as they can."""
        edges = np.tile(self._edges, (len(arms), 1))
        (x, y, z), (a, b, c) = np.repeat(arms, len(self._edges), axis=0).T, edges.T
        A = np.array([a, b, c, y * c - z * b, z * a - x * c, x * b - y * a])[self._rows] * self._scale[:, None]
        whole = np.vstack([A, _PRICE / self._weight * np.eye(A.shape[1])])
        sizes, _ = nnls(self._weight * whole, np.concatenate([self._weight * wanted[self._rows] * self._scale,
                                                              np.zeros(A.shape[1])]))  # fmt: skip
        return (sizes[:, None] * edges).reshape(len(arms), -1, 3).sum(axis=1)


def trunk_inertia(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot) -> np.ndarray:
    """(3, 3) [kg m²] inertia of all that is not a leg about the middle of the hips, in the world's frame."""
    chains = [above(model, foot.on[0]) for foot in robot.feet]
    shared = set(chains[0]) & set(chains[1])
    tops = [next(body for body in reversed(chain) if body not in shared) for chain in chains]
    middle = np.mean([data.xanchor[model.body_jntadr[top]] for top in tops], axis=0)
    out = np.zeros((3, 3))
    for i in range(1, model.nbody):
        if not set(above(model, i)) & set(tops):
            axes, away = data.ximat[i].reshape(3, 3), data.xipos[i] - middle
            out += axes @ np.diag(model.body_inertia[i]) @ axes.T
            out += model.body_mass[i] * (away @ away * np.eye(3) - np.outer(away, away))
    return out


def _rotation(turn: np.ndarray) -> np.ndarray:
    """(3,) [rad] rotation vector of a small turn (3, 3), in the world's frame."""
    return 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
