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

from biped.base.jit import bound, kernel
from biped.control.law import Setup
from biped.control.observation import Observation
from biped.control.regulator import Regulator
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
        start = Observation(model, data, robot)
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
        self._rest = np.array(
            [self._mass, *self._sway, self._height, *self._gravity, *(self._gravity / -self._gravity[2])]
        )
        said = setup.scenario.ground.friction
        friction = USED * (float(model.geom_friction[robot.ground, 0]) if said is None else said)
        angles = np.pi * np.arange(2) if self._planar else 2.0 * np.pi * (np.arange(_EDGES) + 0.5) / _EDGES
        edges = np.column_stack([friction * np.cos(angles), friction * np.sin(angles), np.ones(len(angles))])
        self._edges, self._weight = edges / math.sqrt(1.0 + friction**2), weight
        self._numbers = self._weight, _PRICE / self._weight
        self._low, self._force = np.zeros(len(points), dtype=np.int64), np.zeros_like(points)
        self._wanted = np.zeros(6)
        self._bind(points, start)

    def _bind(self, points: np.ndarray, start: Observation) -> None:
        """Looks the kernels up once: to be called with arrays of these types."""
        A, b = self._problem(1)
        self._support = bound(support, points, points[:, 2], start.com, start.com, self._rest, self._low, self._wanted)
        self._fill = bound(edge_problem, points, start.com, self._low, self._edges, self._rows, self._scale,
                           *self._numbers, self._wanted, A, b)  # fmt: skip
        self._share = bound(share_forces, b, self._edges, self._low, 1, self._force)

    def _problem(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Room for the least-squares problem of so many points."""
        size = count * len(self._edges)
        return np.zeros((len(self._rows) + size, size)), np.zeros(len(self._rows) + size)

    def torques(self, sensed: Observation) -> np.ndarray:
        """(nu,) [N m]."""
        points, com, base = sensed.points, sensed.com, sensed.base
        count = self._support(points, sensed.height, com, sensed.com_velocity, self._rest, self._low, self._wanted)
        error = _rotation(self._orientation @ base.orientation.T)
        self._wanted[3:] = self._trunk @ (TURN**2 * error - 2.0 * TURN * base.angular_velocity)
        A, b = self._problem(count)
        self._fill(points, com, self._low, self._edges, self._rows, self._scale, *self._numbers, self._wanted, A, b)
        sizes, _ = nnls(A, b)
        force = self._force
        self._share(sizes, self._edges, self._low, count, force)
        q, v = sensed.q[self._places], sensed.v[self._columns]
        spring = self._k * (self._posture - q) - self._b * v
        return spring + (sensed.h - sensed.J.T @ force.ravel())[self._columns]


@kernel
def support(points, height, com, com_velocity, rest, low, wanted):
    """Finds the contact points that the robot stands on, and the force of the ground that balances it.

    Args:
        points: (P, 3) [m] contact points.
        height: (P,) [m] of them above the ground.
        com: (3,) [m] centre of mass.
        com_velocity: (3,) [m/s].
        rest: (10,) mass [kg], stiffness [1/s²] and damping [1/s] of the sway, height of the centre of mass [m],
            gravity [m/s²], and its direction.
        low: (P,) numbers of the points, overwritten.
        wanted: (6,) whose first three are the force [N], overwritten.

    Returns:
        How many points there are.
    """
    least = height[0]
    for p in range(height.size):
        least = min(least, height[p])
    count = 0
    for p in range(height.size):
        if height[p] < least + _NEAR:
            low[count] = p
            count += 1
    for i in range(3):
        first, last = points[low[0], i], points[low[0], i]
        for k in range(count):
            first, last = min(first, points[low[k], i]), max(last, points[low[k], i])
        place = 0.5 * (first + last) - rest[3] * rest[7 + i]  # above the middle of what it stands on, against gravity
        wanted[i] = rest[0] * (rest[1] * (place - com[i]) - rest[2] * com_velocity[i] - rest[4 + i])
    return count


@kernel
def edge_problem(points, com, low, edges, rows, scale, weight, price, wanted, A, b):
    """Fills the problem of sharing force and moment among the edges of the points' friction cones.

    Args:
        points: (P, 3) [m] contact points.
        com: (3,) [m] centre of mass.
        low: Numbers of the points that bear.
        edges: (m, 3) directions of a cone's edges.
        rows: (r,) which of force and moment count.
        scale: (r,) of them.
        weight: [N] of the robot.
        price: Of forces, in weights.
        wanted: (6,) [N, N m] force and its moment about the centre of mass.
        A: (r + n, n) of min |A x - b|, x ≥ 0, overwritten; n edges of all points.
        b: (r + n,) likewise.
    """
    size, m = A.shape[1], edges.shape[0]
    for j in range(size):
        p, edge = low[j // m], edges[j % m]
        x, y, z = points[p, 0] - com[0], points[p, 1] - com[1], points[p, 2] - com[2]
        for i in range(rows.size):
            row = rows[i]
            if row < 3:
                value = edge[row]
            elif row == 3:
                value = y * edge[2] - z * edge[1]
            elif row == 4:
                value = z * edge[0] - x * edge[2]
            else:
                value = x * edge[1] - y * edge[0]
            A[i, j] = weight * (value * scale[i])
        A[rows.size + j, j] = weight * price
    for i in range(rows.size):
        b[i] = weight * wanted[rows[i]] * scale[i]


@kernel
def share_forces(sizes, edges, low, count, force):
    """Writes the forces (P, 3) [N] on all points that sizes of the edges of `count` of them add up to."""
    m = edges.shape[0]
    force[:] = 0.0
    for k in range(count):
        for i in range(3):
            total = sizes[k * m] * edges[0, i]
            for j in range(1, m):
                total += sizes[k * m + j] * edges[j, i]
            force[low[k], i] = total


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
