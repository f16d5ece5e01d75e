"""The trajectory of seven links in a plane, whose true columns follow from coordinates and forces; compiled.

A force F over a step changes the kinetic energy by F · (v + v')/2 · dt, impacts included: works of a step are taken at
the mean of its velocities, in the configuration that it begins with. What actuators and pushes give is exact: what was
applied times how far things went.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from biped.base.jit import entry_kernel, inner_kernel
from biped.measure.pushes import declared
from biped.measure.trajectory import Trajectory, mean_powers
from biped.robot.columns import FORCE, Q_D, STOP, Q, U, V
from biped.robot.ground import gravity
from biped.robot.planar import topology
from biped.robot.planar.kinematics import PLACES, TREE, forward
from biped.robot.planar.topology import (
    BASE,
    FOOT,
    KNEE,
    LEGS,
    N_LINKS,
    N_POINTS,
    NQ,
    NU,
    PARENT,
    PITCH,
    POINT_LEG,
    TORSO,
    X,
    Z,
)
from biped.robot.planar.tree import Tree, motion
from biped.robot.robot import Robot, seven_links

if TYPE_CHECKING:
    import mujoco


_RECORD = np.dtype(
    [("generalized", "u1"), ("tick", "f8"), ("gravity", "f8", 2), ("tree", TREE), ("even", PLACES), ("odd", PLACES)],
    align=True,
)
"""Constants of the run for the pass; places are those of the latest two rows."""


class Derived(NamedTuple):
    """Columns that follow from coordinates, velocities and forces, row by row.

    Attributes:
        point: (n, 4, 3) [m] toes and heels.
        force: (n, 4, 3) [N] of the ground on them in the step after each row.
        foot_force: (2, n) [N] normal forces under the feet.
        com: (n, 3) [m] centre of mass.
        com_velocity: (n, 3) [m/s].
        moving: (n,) [J] kinetic energy of the links' centres of mass.
        energy: (n,) [J] kinetic and potential.
        work: (n,) [J] of everything but gravity in the step after each row; 0 in the last.
        given: (n,) [J] of actuators and pushes, likewise.
        spent: (n,) [J] of the sum of actuators' powers and of that of pushes, either way, likewise.
        speed: (2, n) [m²/s², rad²/s²] largest square of a link's speed and of its turning.
        outside: (n, 9) angular momentum about the centre of mass [N m s], and force [N] and moment about it [N m] of
            ground, seat, pushes and, where Q_d itself moves it, Q_d in the step after each row.
    """

    point: np.ndarray
    force: np.ndarray
    foot_force: np.ndarray
    com: np.ndarray
    com_velocity: np.ndarray
    moving: np.ndarray
    energy: np.ndarray
    work: np.ndarray
    given: np.ndarray
    spent: np.ndarray
    speed: np.ndarray
    outside: np.ndarray


class Forces(NamedTuple):
    """Loads on seven links beside those that are logged.

    Attributes:
        generalized: Whether Q_d itself moves them.
        gravity: [m/s²] along the ground and normal to it.
        pushes: (m, 5) first row, last row + 1, force along and normal to the ground [N], number of the link.
        seat: (n, 3) of a seat on the pelvis: force along and normal to the ground [N], moment [N m]; (0, 3) without.
    """

    generalized: bool
    gravity: tuple[float, float]
    pushes: np.ndarray
    seat: np.ndarray


def derive(log: np.ndarray, tick: float, tree: Tree, forces: Forces) -> Derived:
    """Returns the true columns of a run of seven links.

    Args:
        log: (n, width) of the run.
        tick: [s] between rows.
        tree: Lengths and masses.
        forces: What acts.
    """
    record = np.zeros(1, _RECORD)
    record["generalized"], record["tick"], record["gravity"] = forces.generalized, tick, forces.gravity
    for name, value in tree._asdict().items():
        record["tree"][0][name] = value
    n = len(log)
    out = Derived(np.zeros((n, N_POINTS, 3)), np.zeros((n, N_POINTS, 3)), np.zeros((LEGS, n)), np.zeros((n, 3)),
                  np.zeros((n, 3)), np.zeros(n), np.empty(n), np.zeros(n), np.zeros(n), np.zeros(n),
                  np.empty((2, n)), np.zeros((n, 9)))  # fmt: skip
    _derive_rows(record, np.ascontiguousarray(log), forces.pushes, np.ascontiguousarray(forces.seat), *out)
    return out


@entry_kernel
def _derive_rows(
    record, log, pushes, seat, point, force, foot_force, com, com_velocity, moving, energy, work, given, spent, speed,
    outside,
):  # fmt: skip
    """Fills the arrays of `Derived`."""
    s = record[0]
    total = 0.0
    for j in range(N_LINKS):
        total += s["tree"]["mass"][j]
    for k in range(log.shape[0]):
        at, before = (s["even"], s["odd"]) if k % 2 == 0 else (s["odd"], s["even"])
        _derive_row(s, at, log[k], total, point[k], com[k], com_velocity[k], moving, energy, speed, k)
        for i in range(N_POINTS):
            force[k, i, 0], force[k, i, 2] = log[k, FORCE + 2 * i], log[k, FORCE + 2 * i + 1]
            foot_force[POINT_LEG[i], k] += force[k, i, 2]
        _derive_outside(s, at, log[k], pushes, seat, com[k], com_velocity[k], outside[k], k)
        if k > 0:
            _derive_step(s, at, before, log[k - 1], log[k], pushes, seat, work, given, spent, k - 1)


@inner_kernel
def _larger(best, x):
    """The larger of two; a number that is none stays, and wins."""
    return best if x <= best or math.isnan(best) else x


@inner_kernel
def _derive_row(s, at, line, total, point, com, com_velocity, moving, energy, speed, k):
    """Fills the places, the energy and the largest speeds of row k."""
    tree, q, v = s["tree"], line[Q : Q + NQ], line[V : V + NQ]
    forward(tree, q, v, q[X], q[Z], at)
    squared, turning, kinetic, x, z, vx, vz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(N_LINKS):
        mass, fast, up = tree["mass"][j], at["com_velocity"][j, 0], at["com_velocity"][j, 1]
        square, rate = fast * fast + up * up, at["rate"][j] * at["rate"][j]
        squared, turning = _larger(squared, square), _larger(turning, rate)
        moving[k] += 0.5 * mass * square
        kinetic += 0.5 * (mass * square + tree["inertia"][j] * rate)
        x, z = x + mass * at["com"][j, 0], z + mass * at["com"][j, 1]
        vx, vz = vx + mass * fast, vz + mass * up
    for j in range(NU):
        kinetic += 0.5 * tree["armature"][j] * v[BASE + j] * v[BASE + j]
    for i in range(N_POINTS):
        point[i, 0], point[i, 2] = at["point"][i, 0], at["point"][i, 1]
    com[0], com[2] = x / total, z / total
    com_velocity[0], com_velocity[2] = vx / total, vz / total
    energy[k] = kinetic - s["gravity"][0] * x - s["gravity"][1] * z
    speed[0, k], speed[1, k] = squared, turning


@inner_kernel
def _derive_outside(s, at, line, pushes, seat, com, com_velocity, out, k):
    """Fills the angular momentum of row k, and what acts from outside in the step after it."""
    tree, x, z = s["tree"], com[0], com[2]
    spin = 0.0
    for j in range(N_LINKS):
        fast, up = at["com_velocity"][j, 0] - com_velocity[0], at["com_velocity"][j, 1] - com_velocity[2]
        arm = (at["com"][j, 0] - x) * up - (at["com"][j, 1] - z) * fast
        spin += tree["inertia"][j] * at["rate"][j] + tree["mass"][j] * arm
    out[1] = -spin  # about y, which points to the left
    for i in range(N_POINTS):
        fx, fz = line[FORCE + 2 * i], line[FORCE + 2 * i + 1]
        if fx != 0.0 or fz != 0.0:
            _add_outside(out, at["point"][i, 0] - x, at["point"][i, 1] - z, fx, fz)
    for p in range(pushes.shape[0]):
        if pushes[p, 0] <= k < pushes[p, 1]:
            here = at["com"][int(pushes[p, 4])]
            _add_outside(out, here[0] - x, here[1] - z, pushes[p, 2], pushes[p, 3])
    if seat.shape[0] > 0:
        _add_outside(out, line[Q + X] - x, line[Q + Z] - z, seat[k, 0], seat[k, 1])
        out[7] -= seat[k, 2]
    if s["generalized"]:
        _add_outside(out, line[Q + X] - x, line[Q + Z] - z, line[Q_D + X], line[Q_D + Z])
        out[7] -= line[Q_D + PITCH]


@inner_kernel
def _add_outside(out, x, z, fx, fz):
    """Adds a force at a place relative to the centre of mass."""
    out[3] += fx
    out[5] += fz
    out[7] += z * fx - x * fz


@inner_kernel
def _derive_step(s, at, before, was, line, pushes, seat, work, given, spent, k):
    """Fills the works of the step from row k to the next."""
    tree = s["tree"]
    column, count = (Q_D, NQ) if s["generalized"] else (U, NU)
    power, put_in = 0.0, 0.0
    for i in range(count):
        j = NQ - count + i
        power += was[column + i] * 0.5 * (was[V + j] + line[V + j])
        put_in += was[column + i] * (line[Q + j] - was[Q + j])
    actuators = power
    for p in range(pushes.shape[0]):
        if pushes[p, 0] <= k < pushes[p, 1]:
            link, fx, fz = int(pushes[p, 4]), pushes[p, 2], pushes[p, 3]
            here, there = before["com"][link], at["com"][link]
            power += _power(at, before, was, line, link, here[0], here[1], fx, fz)
            put_in += fx * (there[0] - here[0]) + fz * (there[1] - here[1])
    spent[k] = s["tick"] * (abs(actuators) + abs(power - actuators))
    for leg in range(LEGS):
        power += was[STOP + leg] * 0.5 * (was[V + KNEE[leg]] + line[V + KNEE[leg]])
    for j in range(NU):
        mean = 0.5 * (was[V + BASE + j] + line[V + BASE + j])
        power -= tree["damping"][j] * mean * mean
    for i in range(N_POINTS):
        fx, fz = was[FORCE + 2 * i], was[FORCE + 2 * i + 1]
        if fx != 0.0 or fz != 0.0:
            x, z = before["point"][i, 0], before["point"][i, 1]
            power += _power(at, before, was, line, FOOT[POINT_LEG[i]], x, z, fx, fz)
    if seat.shape[0] > 0:
        for i, j in enumerate((X, Z, PITCH)):
            power += seat[k, i] * 0.5 * (was[V + j] + line[V + j])
    work[k], given[k] = s["tick"] * power, put_in


@inner_kernel
def _power(at, before, was, line, link, x, z, fx, fz):
    """Power [W] of a force at a place (x, z) of a link in the configuration `before`, at the step's mean velocity."""
    vx, vz = 0.5 * (was[V + X] + line[V + X]), 0.5 * (was[V + Z] + line[V + Z])
    i = link
    while i >= TORSO:
        rate = 0.5 * (before["rate"][i] + at["rate"][i])
        px, pz = before["joint"][i, 0], before["joint"][i, 1]
        vx -= (z - pz) * rate
        vz += (x - px) * rate
        x, z = px, pz
        i = PARENT[i]
    return fx * vx + fz * vz


class PlanarTrajectory(Trajectory):
    """A run of seven links in a plane."""

    @cached_property
    def derived(self) -> Derived:
        """True columns, which are not logged."""
        slope = math.radians(self.slope)
        c, s = math.cos(slope), math.sin(slope)
        pushes = [
            (round(start / self.tick), round(end / self.tick), forward * c + up * s, up * c - forward * s,
             self.robot.bodies.index(body))
            for start, end, (forward, _, up), body in declared(self) if body in self.robot.bodies
        ]  # fmt: skip
        seat = np.empty((0, 3)) if self.seat_force is None else self.seat_force
        acting = Forces(self.generalized, gravity(self.slope), np.array(pushes, dtype=float).reshape(-1, 5), seat)
        return derive(self.log, self.tick, self.tree, acting)

    def _true(self, name: str) -> np.ndarray:
        return getattr(self.derived, name)

    @property
    def _outside(self) -> np.ndarray:
        return self.derived.outside

    @cached_property
    def contact(self) -> np.ndarray:
        """(n, 4) whether the contact points touch the ground (0 or 1)."""
        return (self.above <= 0.0).astype(float)

    @cached_property
    def ground_force(self) -> np.ndarray:
        """(n, 3) [N] force of the ground on all of the robot in the steps after each row."""
        return np.einsum("ijk->ik", self.force)

    @cached_property
    def base(self) -> np.ndarray:
        """(n, 7) place [m] and orientation (quaternion, w first) of the base."""
        out, half = np.zeros((len(self), 7)), 0.5 * self.q[:, PITCH]
        out[:, 0], out[:, 2], out[:, 3], out[:, 5] = self.q[:, 0], self.q[:, 1], np.cos(half), -np.sin(half)
        return out

    @cached_property
    def figure(self) -> np.ndarray:
        """(n, 7, 3) [m] hip, knee and ankle of each leg, and the trunk's upper end."""
        pose = motion(self.tree, self.q, self.v)
        joints = pose.joint[:, [link for chain in topology.CHAINS for link in chain[1:]]]
        c, s = np.cos(self.q[:, PITCH]), np.sin(self.q[:, PITCH])
        x, _, z = self.robot.top
        top = pose.joint[:, 0] + np.stack([c * x - s * z, s * x + c * z], axis=1)
        out = np.zeros((len(self), joints.shape[1] + 1, 3))
        out[..., [0, 2]] = np.concatenate([joints, top[:, None]], axis=1)
        return out

    @property
    def x(self) -> np.ndarray:
        """(n,) [m] of the base, along the ground."""
        return self.q[:, X]

    @property
    def y(self) -> np.ndarray:
        """(n,) [m] of the base, to the left: none."""
        return np.zeros(len(self))

    @cached_property
    def lean(self) -> np.ndarray:
        """(n,) [rad] of the base from the vertical, forward positive."""
        return -self.q[:, PITCH] - math.radians(self.slope)

    @cached_property
    def tilt(self) -> np.ndarray:
        """(n,) [rad] of the base from the vertical, whichever way it leans."""
        up, half = -np.array(self.gravity) / np.linalg.norm(self.gravity), 0.5 * self.q[:, PITCH]
        s, axis = -np.sin(half), np.zeros((len(self), 3))
        axis[:, 0], axis[:, 2] = 2 * (np.cos(half) * s), 1 - 2 * (s * s)
        return np.arccos(np.clip(axis @ up, -1.0, 1.0))

    @property
    def foot_force(self) -> np.ndarray:
        """(n, 2) [N] normal force of the ground under each foot."""
        return self.derived.foot_force.T

    @property
    def spent(self) -> np.ndarray:
        """(n,) [J] of the sum of actuators' powers and of that of pushes, either way."""
        return self.derived.spent

    @property
    def has_torques(self) -> bool:
        """Whether the torques of the actuators are known: of Q_d that acts itself, too."""
        return True

    @property
    def net_power(self) -> np.ndarray:
        """(n - 1,) [W] mean sum of the powers of all that the law does from each row to the next."""
        return mean_powers(self.applied, self.v).sum(axis=1)

    @property
    def link_speed(self) -> np.ndarray:
        """(2, n) [m²/s², rad²/s²] largest square of a link's speed and of its turning."""
        return self.derived.speed

    @property
    def moving_energy(self) -> np.ndarray:
        """(n,) [J] kinetic energy of the links' centres of mass."""
        return self.derived.moving

    @property
    def joint_angles(self) -> np.ndarray:
        """(n, 6) [rad] of hip, knee and ankle; right, then left."""
        return self.q[:, BASE:]

    @property
    def joint_rates(self) -> np.ndarray:
        """(n, 6) [rad/s] of the joint angles."""
        return self.v[:, BASE:]

    @property
    def joint_torques(self) -> np.ndarray:
        """(n, 6) [N m] that act on the joint angles."""
        return self.applied[:, BASE:]

    def qpos(self, model: mujoco.MjModel) -> np.ndarray:
        """(n, 9) coordinates as a MuJoCo model of the robot has them."""
        from biped.robot.planar.order import order_of

        out = np.empty_like(self.q)
        out[:, order_of(model, seven_links(self.robot)).joints] = self.q
        return out


def kind_of(robot: Robot) -> type[Trajectory]:
    """Returns the class of a robot's trajectories."""
    return Trajectory if robot.seven_links is None else PlanarTrajectory
