"""Standing for any robot: ground forces that balance its centre of mass, and springs that keep its posture.

What the ground must push with follows from where the centre of mass is, how fast it moves and how the base leans; it is
shared among the contact points that touch, which only push and only within friction; joint torques are what bears it
(Ott, Roa and Hirzinger, "Posture and balance control for biped robots based on contact force optimization", 2011).

Feet that are points stand by a linear-quadratic regulator about an upright equilibrium: two points bear no moment about
the line through them, so that only turning parts of the body moves the centre of mass across it. The motion near the
equilibrium, contacts included, is linearised by finite differences of MuJoCo's own step.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from scipy.optimize import least_squares, nnls

from biped.base.jit import bound, kernel
from biped.control.law import Setup
from biped.control.observation import Observation
from biped.robot.parts import above, belongs, height_of
from biped.robot.robot import Robot
from biped.robot.sole import points_of

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
        if belongs(model, i, robot.base_number) and not set(above(model, i)) & set(tops):
            axes, away = data.ximat[i].reshape(3, 3), data.xipos[i] - middle
            out += axes @ np.diag(model.body_inertia[i]) @ axes.T
            out += model.body_mass[i] * (away @ away * np.eye(3) - np.outer(away, away))
    return out


def _rotation(turn: np.ndarray) -> np.ndarray:
    """(3,) [rad] rotation vector of a small turn (3, 3), in the world's frame."""
    return 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
